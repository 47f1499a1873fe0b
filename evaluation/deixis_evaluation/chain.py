"""The cores of all stages one after the other, in this process: pictures in, what the stages say of them out. No transport."""

from __future__ import annotations

from dataclasses import dataclass

from deixis_fusion.config import FusionConfig
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_gesture.config import GestureConfig
from deixis_gesture.recognizer import GestureRecognizer
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_runtime.lens import Lens
from deixis_schemas.messages import CameraInfo, Gestures, HeadPoses, OfFrame, Producer, Target, Tracks
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker

from .replay import INSTANCE, RUN, START_NS, Picture


@dataclass(frozen=True)
class Answers:
    """What was said of one picture; `targets`: pointing episodes that it ended."""

    tracks: Tracks
    poses: HeadPoses
    gestures: Gestures
    targets: tuple[Target, ...]


class Chain:
    """All stages on one source of pictures of the same size. Pictures are given in order, with their times."""

    def __init__(self, camera: CameraInfo) -> None:
        """`camera` has to have intrinsics. Raises LensError where it has none."""
        self._lens = Lens.of(camera)
        self._tracker = Tracker(TrackerConfig())
        self._headpose = HeadPoseEstimator(HeadposeConfig())
        self._gesture = GestureRecognizer(GestureConfig())
        self._fusion = Fusion(FusionConfig(), Producer("fusion", INSTANCE))
        self._fusion.set_camera(camera)
        self._seq = -1

    def see(self, picture: Picture, time_s: float) -> Answers:
        """Answer the next picture (height, width, 3), BGR, taken `time_s` after the first."""
        self._seq += 1
        stamp_ns = START_NS + round(time_s * 1e9)
        frame = OfFrame(run=RUN, seq=self._seq, stamp_ns=stamp_ns, stage="camera", instance=INSTANCE)
        height, width = picture.shape[:2]
        found = self._tracker.update(picture, RUN, stamp_ns)
        tracks = Tracks.derive(frame, Producer("tracker", INSTANCE), width=width, height=height, tracks=found)
        heads = self._headpose.update(picture, found, self._lens, RUN, stamp_ns)
        poses = HeadPoses.derive(frame, Producer("headpose", INSTANCE), poses=heads)
        hands = self._gesture.update(found, width, height, self._lens, RUN, stamp_ns)
        gestures = Gestures.derive(frame, Producer("gesture", INSTANCE), gestures=hands)
        _, targets = self._fusion.answer(JoinedFrame(tracks, poses, gestures), {}, None)
        return Answers(tracks, poses, gestures, tuple(target for target in targets if target.final))

    def end(self) -> tuple[Target, ...]:
        """Episodes that were open when the pictures ended."""
        return tuple(target for target in self._fusion.end(None) if target.final)


def camera_of(width: int, height: int, focal_px: float) -> CameraInfo:
    """A level camera without distortion, its optical axis in the middle of the picture."""
    matrix = (focal_px, 0.0, (width - 1) / 2, 0.0, focal_px, (height - 1) / 2, 0.0, 0.0, 1.0)
    return CameraInfo(
        stamp_ns=START_NS,
        stage="camera",
        instance=INSTANCE,
        state="streaming",
        source="pictures",
        width=width,
        height=height,
        camera_matrix=matrix,
        run=RUN,
    )
