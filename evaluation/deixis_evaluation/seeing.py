"""Who says what is tracked in a clip that is played to single stages: the tracker's core, or the labels."""

from __future__ import annotations

from collections.abc import Callable

from deixis_schemas.messages import OfFrame, Producer, Tracks
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import FrameRefused, Tracker

from .clips import Clip
from .replay import INSTANCE, Picture
from .true_tracks import TrueTracks

See = Callable[[OfFrame, Picture], Tracks]
"""From the next frame and its picture to its tracks."""


def seen_in_labels(clip: Clip) -> See:
    """The truth. Raises ClipError for label pictures that cannot be read."""
    truth = TrueTracks(clip)
    return lambda frame, _: truth.of_frame(frame)


def seen_by_tracker(config: TrackerConfig) -> See:
    """What the tracker makes of the pictures."""
    tracker = Tracker(config)

    def see(frame: OfFrame, picture: Picture) -> Tracks:
        try:
            tracks = tracker.update(picture, frame.run, frame.stamp_ns)
        except FrameRefused:
            tracks = []  # as the stage's shell answers
        height, width = picture.shape[:2]
        said = {"width": width, "height": height, "room_offset_px": tracker.room_offset_px}
        return Tracks.derive(frame, Producer("tracker", INSTANCE), tracks=tracks, **said)

    return see
