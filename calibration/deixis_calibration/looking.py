"""What the tracker sees of somebody: frames in, the one that shows most out, with its tracks, its skin and its measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from deixis_schemas.messages import Track
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker

from .picture_measures import Box, Image, PictureMeasures, light_in, measure

HANDS = ("left_hand", "right_hand")
LIKELIER = 128
"""P(skin) of 255 from which skin is likelier than not."""


@dataclass(frozen=True)
class FaceMeasures:
    """width_px: ear to ear; light: mean brightness of the face, 0 to 255."""

    width_px: float
    light: float
    box: Box


@dataclass(frozen=True, eq=False)
class Seen:
    """One frame. skin (h, w): P(skin) of 255, of any size. hands: most that were seen at once in any frame; frames: how many
    were looked at. skin_elsewhere: share of the picture that passes for skin and is nobody's.
    """

    image: Image
    tracks: tuple[Track, ...]
    skin: Image
    picture: PictureMeasures
    faces: tuple[FaceMeasures, ...]
    hands: int
    skin_elsewhere: float
    frames: int


class Looking:
    """Plays frames to a tracker of its own. Where the tracks of the running tracker are heard, these count in place of its."""

    def __init__(self, config: TrackerConfig) -> None:
        self._tracker = Tracker(config)
        self._best: tuple[Image, tuple[Track, ...], Image] | None = None
        self._most = (0, 0)
        self._hands = self._frames = 0

    def add(self, image: Image, run: int, stamp_ns: int, heard: Sequence[Track] | None = None) -> None:
        """Take in a frame (h, w, 3) BGR, with what the running tracker said of it. Raises FrameRefused."""
        own = self._tracker.update(image, run, stamp_ns)
        tracks = tuple(track for track in (own if heard is None else heard) if track.observed)
        shown = sum(track.kind == "face" for track in tracks), sum(track.kind in HANDS for track in tracks)
        self._frames += 1
        self._hands = max(self._hands, shown[1])
        # Of equal ones the newest: by then the tracker has learned the room.
        if self._best is None or shown >= self._most:
            self._best, self._most = (image, tracks, self._tracker.skin), shown

    def seen(self) -> Seen | None:
        """The frame that shows most; none before the first."""
        if self._best is None:
            return None
        image, tracks, skin = self._best
        boxes = [track.bbox_px for track in tracks if track.kind == "face"]
        faces = tuple(FaceMeasures(box[2], light_in(image, box), box) for box in boxes)
        elsewhere = _skin_elsewhere(skin, image, tracks)
        return Seen(image, tracks, skin, measure(image), faces, self._hands, elsewhere, self._frames)


def _skin_elsewhere(skin: Image, image: Image, tracks: Sequence[Track]) -> float:
    """Share of the picture that passes for skin and lies in no track's box, widened by half: necks and arms are skin, too."""
    mask = skin >= LIKELIER
    scale = skin.shape[1] / image.shape[1]
    for track in tracks:
        x, y, w, h = (value * scale for value in track.bbox_px)
        mask[max(0, int(y - h / 2)) : int(y + 1.5 * h) + 1, max(0, int(x - w / 2)) : int(x + 1.5 * w) + 1] = False
    return float(np.mean(mask))
