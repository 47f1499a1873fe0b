"""Each stage's core on what it was given: the frames of a clip, and the answers of the stages before it. No processes.

One small function a stage is all that knows how its core is called.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
import numpy.typing as npt
from deixis_fusion.config import FusionConfig
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_fusion.localisation import RobotPlace
from deixis_gesture.config import GestureConfig
from deixis_gesture.recognizer import GestureRecognizer
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_runtime.lens import Lens
from deixis_schemas.messages import (
    CameraInfo,
    Gestures,
    HeadPoses,
    Message,
    OfFrame,
    Poi,
    Producer,
    Tracks,
)
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker

from .camera_pose import map_position, mount_of
from .clips import Clip

Picture = npt.NDArray[np.uint8]
T = TypeVar("T", bound=Message)

START_NS = 10**18
RUN = 1
INSTANCE = "replay"


class ReplayError(RuntimeError):
    """A clip that cannot be read to its end."""


@dataclass(frozen=True)
class Given:
    """What a stage is given: a clip, and the answers of the stages before it, in the order in which they were published."""

    clip: Clip
    answers: Sequence[Message] = ()

    def of(self, type_: type[T]) -> list[T]:
        """The answers of one type."""
        return [message for message in self.answers if isinstance(message, type_)]

    def pictures(self) -> Iterator[tuple[OfFrame, Picture]]:
        """Each frame's identity and its picture, BGR, height x width x 3. Raises ReplayError."""
        video = cv2.VideoCapture(str(self.clip.video))
        try:
            for seq in range(len(self.clip.truth.frames)):
                read, picture = video.read()
                if not read:
                    raise ReplayError(f"'{self.clip.video}' ends at frame {seq}, its labels do not")
                self._check_size(*picture.shape[1::-1])
                yield self.frame(seq), np.asarray(picture, dtype=np.uint8)
        finally:
            video.release()

    def _check_size(self, width: int, height: int) -> None:
        meta = self.clip.truth.meta
        if (width, height) != (meta.width, meta.height):
            raise ReplayError(f"'{self.clip.video}' is {width} x {height}, its labels speak of {meta.width} x {meta.height}")

    def frame(self, seq: int) -> OfFrame:
        """The frame's identity, with media time for its stamp."""
        stamp_ns = START_NS + round(seq * 1e9 / self.clip.truth.meta.fps)
        return OfFrame(run=RUN, seq=seq, stamp_ns=stamp_ns, stage="camera", instance=INSTANCE)

    def camera(self) -> CameraInfo:
        """What the camera says of itself."""
        meta = self.clip.truth.meta
        return CameraInfo(
            stamp_ns=START_NS,
            stage="camera",
            instance=INSTANCE,
            state="streaming",
            source=self.clip.name,
            width=meta.width,
            height=meta.height,
            rate_hz=meta.fps,
            camera_matrix=meta.camera.matrix,
            distortion_model=meta.camera.distortion_model,
            distortion=meta.camera.dist,
            mount=mount_of(meta.camera),
            run=RUN,
        )

    def pois(self) -> list[Poi]:
        """The points of interest of the clip's place."""
        meta = self.clip.truth.meta
        return [Poi(poi_id=poi.id, position_m=map_position(meta.camera, poi.xyz_world)) for poi in meta.pois]


def replay_tracker(given: Given) -> Sequence[Message]:
    """Pictures to Tracks."""
    producer, tracker = Producer("tracker", INSTANCE), Tracker(TrackerConfig())
    meta, made = given.clip.truth.meta, []
    for frame, picture in given.pictures():
        tracks = tracker.update(picture, frame.run, frame.stamp_ns)
        said = {"width": meta.width, "height": meta.height, "room_offset_px": tracker.room_offset_px}
        made.append(Tracks.derive(frame, producer, tracks=tracks, **said))
    return made


def replay_headpose(given: Given) -> Sequence[Message]:
    """Pictures and Tracks to HeadPoses."""
    producer, estimator = Producer("headpose", INSTANCE), HeadPoseEstimator(HeadposeConfig())
    lens, made = Lens.of(given.camera()), []
    for (frame, picture), seen in zip(given.pictures(), given.of(Tracks), strict=True):
        poses = estimator.update(picture, seen.tracks, lens, frame.run, frame.stamp_ns)
        made.append(HeadPoses.derive(frame, producer, poses=poses))
    return made


def replay_gesture(given: Given) -> Sequence[Message]:
    """Tracks to Gestures."""
    producer, recognizer = Producer("gesture", INSTANCE), GestureRecognizer(GestureConfig())
    lens, mount, made = Lens.of(given.camera()), given.camera().mount, []
    for seen in given.of(Tracks):
        size, offset = (seen.width, seen.height), seen.room_offset_px
        gestures = recognizer.update(seen.tracks, *size, lens, seen.run, seen.stamp_ns, offset, mount)
        made.append(Gestures.derive(seen, producer, gestures=gestures))
    return made


def replay_fusion(given: Given) -> Sequence[Message]:
    """Tracks, HeadPoses and Gestures to Beliefs, each after the Targets of its frame."""
    fusion = Fusion(FusionConfig(), Producer("fusion", INSTANCE))
    fusion.set_pois(given.pois())
    fusion.set_camera(given.camera())
    fusion.start_robot_at(RobotPlace())
    made: list[Message] = []
    for tracks, poses, gestures in zip(given.of(Tracks), given.of(HeadPoses), given.of(Gestures), strict=True):
        belief, targets = fusion.answer(JoinedFrame(tracks, poses, gestures), {}, None)
        made += [*targets, belief]
    return [*made, *fusion.end(None)]


REPLAYS: dict[str, Callable[[Given], Sequence[Message]]] = {
    "tracker": replay_tracker,
    "headpose": replay_headpose,
    "gesture": replay_gesture,
    "fusion": replay_fusion,
}
"""In the order of the chain: a stage is given the answers of those before it."""
