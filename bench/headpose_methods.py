"""The methods that bench/headpose.py compares: all see the same frames and tracks, and say a yaw for each head."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, get_args

from affine_alignment import FacePatch
from deixis_evaluation.clips import Box
from deixis_evaluation.replay import RUN
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_headpose.initialise import Initialiser
from deixis_runtime.lens import Lens
from deixis_runtime.settings import CommonOptions, load_config
from deixis_schemas.messages import Point, Track
from headpose_inputs import Footage, Seen

ECC = "ecc"
MESH, MESH_PNP = "facemesh", "facemesh_pnp"


@dataclass(frozen=True)
class Said:
    """The yaw of a head, degrees, relative to the line from head to camera; its sigma where the method has one.

    box_px: (x, y, w, h) of the face that it speaks of.
    """

    box_px: Box
    yaw_deg: float
    sigma_deg: float | None = None


@dataclass(frozen=True)
class Answers:
    """What a method said of each frame of some footage, and the processor time that it took, seconds."""

    frames: list[list[Said]]
    cpu_s: float


class Method(Protocol):
    """A method on one camera. Frames are given in order."""

    def update(self, frame: Seen, lens: Lens) -> list[Said]:
        """The heads of the next frame."""


class Deixis:
    """The core of the headpose stage."""

    def __init__(self, config: HeadposeConfig) -> None:
        self._estimator = HeadPoseEstimator(config)

    def update(self, frame: Seen, lens: Lens) -> list[Said]:
        """The heads of the next frame that are tracked."""
        boxes = {track.person_id: track.bbox_px for track in frame.faces}
        poses = self._estimator.update(frame.picture, frame.tracks, lens, RUN, frame.stamp_ns)
        return [
            Said(boxes[pose.person_id], pose.yaw_deg, pose.yaw_sigma_deg)
            for pose in poses
            if pose.status == "tracking" and pose.yaw_deg is not None and pose.person_id in boxes
        ]


@dataclass
class Ecc:
    """cv2.findTransformECC on the face patch, begun on the same frontal views as Deixis."""

    patches: dict[int, FacePatch] = field(default_factory=dict)
    starts: dict[int, Initialiser] = field(default_factory=dict)

    def update(self, frame: Seen, lens: Lens) -> list[Said]:  # noqa: ARG002 - the affine map is of weak perspective
        """The heads of the next frame whose patch is found."""
        said = []
        for track in frame.faces:
            yaw = self._yaw_of(track, frame)
            if yaw is not None:
                said.append(Said(track.bbox_px, yaw))
        return said

    def _yaw_of(self, track: Track, frame: Seen) -> float | None:
        person, centre = track.person_id, _centre(track)
        assert person is not None
        patch = self.patches.get(person)
        if patch is not None:
            yaw = patch.follow(frame.picture, centre, frame.stamp_ns)
            if yaw is not None or not patch.is_lost(frame.stamp_ns):
                return yaw
        start = self.starts.setdefault(person, Initialiser(HeadposeConfig().initial_views))
        agreed = start.update(track.frontal, centre, frame.stamp_ns)
        if agreed is None:
            return None
        self.patches[person] = FacePatch.of(frame.picture, centre, agreed.centre_px, agreed.width_px, frame.stamp_ns)
        del self.starts[person]  # the next start needs sightings of its own
        return 0.0


def deixis_methods() -> tuple[str, ...]:
    """The head pose methods that Deixis' settings offer, its default first."""
    method = HeadposeConfig.model_fields["method"]
    return tuple(sorted(get_args(method.annotation), key=lambda name: name != method.default))


def config_of(method: str, sets: list[str]) -> HeadposeConfig:
    """Deixis' settings for one of its methods, with `--set NAME=VALUE` on top. Raises ConfigError."""
    options = CommonOptions("bench", "bench", "", True, False, 0, None, (f"method={method}", *sets))
    return load_config("headpose", HeadposeConfig, options)


def maker_of(name: str, sets: list[str]) -> Callable[[], Method]:
    """What begins a method anew. Raises ConfigError, and ValueError for a name that is none."""
    if name == ECC:
        return Ecc
    if name not in deixis_methods():
        raise ValueError(f"no method '{name}'; there are {', '.join((*deixis_methods(), ECC, MESH))}")
    config = config_of(name, sets)
    return lambda: Deixis(config)


def run(make: Callable[[], Method], footage: Footage) -> Answers:
    """A method on some footage, begun anew."""
    method, frames = make(), []
    before = time.process_time()
    for frame in footage.frames:
        frames.append(method.update(frame, footage.lens))
    return Answers(frames, time.process_time() - before)


def _centre(track: Track) -> Point:
    x, y, width, height = track.bbox_px
    return x + (width - 1) / 2, y + (height - 1) / 2
