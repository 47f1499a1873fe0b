"""Head yaw of the persons in view: frame and tracks -> head poses. The core of the stage: no clock, no transport."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from deixis_runtime.lens import Lens
from deixis_schemas.messages import HeadPose, Track
from deixis_schemas.runs import RunClock
from numpy.typing import NDArray

from .affine_head import AffineHead
from .config import HeadposeConfig
from .ellipsoid_head import EllipsoidHead
from .head import ellipsoid
from .regressed_head import RegressedHead
from .regression import Regression
from .sight import LEAST_FACE_PX, HeadState, Sight, centre_of


class Head(Protocol):
    """One head through time, by one of the methods."""

    def update(self, sight: Sight) -> HeadState:
        """The head in the next frame."""


def heads_of(config: HeadposeConfig) -> Callable[[], Head]:
    """What makes the head of a new person, by the setting `method`."""
    if config.method == "regression":
        regression = Regression()
        return lambda: RegressedHead(config, regression)
    surface = ellipsoid(config.head_semi_axes_m, config.surface_points, highest=-0.92, lowest=0.85)
    follower = EllipsoidHead if config.method == "ellipsoid" else AffineHead
    return lambda: follower(config, surface)


class HeadPoseEstimator:
    """Estimates the yaw of every person that has a face track, the `max_persons` largest."""

    def __init__(self, config: HeadposeConfig) -> None:
        self._config = config
        self._clock = RunClock()
        self._new_head = heads_of(config)
        self._heads: dict[int, Head] = {}
        self._seen_ns: dict[int, int] = {}

    def update(self, image: NDArray[np.uint8], tracks: Sequence[Track], lens: Lens, run: int, stamp_ns: int) -> list[HeadPose]:
        """Estimate the heads of one frame.

        image: (H, W, 3) BGR or (H, W) grey, uint8. tracks: those of the same frame. lens: what it was taken through. run:
        the camera's; another one starts all heads anew. stamp_ns: capture time. Raises ValueError for a picture of another
        type.
        """
        if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
            raise ValueError(f"image: needs uint8 of shape (H, W, 3) or (H, W), got {image.dtype} {image.shape}")
        moment = self._clock.advance(run, stamp_ns)
        if moment.new_run:
            self._heads.clear()
            self._seen_ns.clear()
        faces = _largest_faces(tracks, self._config.max_persons)
        self._forget(moment.now_ns, {face.person_id for face in faces})
        hands = [track for track in tracks if track.kind != "face"]
        return [self._estimate(face, hands, image, lens, moment.now_ns) for face in faces]

    def _estimate(self, face: Track, hands: Sequence[Track], image: NDArray[np.uint8], lens: Lens, now_ns: int) -> HeadPose:
        person = face.person_id
        assert person is not None
        if person not in self._heads:
            self._heads[person] = self._new_head()
        self._seen_ns[person] = now_ns
        camera = lens.pinhole_at(centre_of(face), (image.shape[1], image.shape[0]))
        return self._heads[person].update(Sight(image, camera, face, hands, now_ns)).of_person(person)

    def _forget(self, now_ns: int, present: set[int | None]) -> None:
        for person in [p for p, seen in self._seen_ns.items() if p not in present]:
            if now_ns - self._seen_ns[person] > self._config.forget_s * 1e9:
                del self._heads[person], self._seen_ns[person]


def _largest_faces(tracks: Sequence[Track], count: int) -> list[Track]:
    """Face tracks of known persons, one each, largest first."""
    faces = [t for t in tracks if t.kind == "face" and t.person_id is not None and min(t.bbox_px[2:]) >= LEAST_FACE_PX]
    faces.sort(key=lambda t: (-t.bbox_px[2] * t.bbox_px[3], t.track_id))
    by_person: dict[int | None, Track] = {}
    for face in faces:
        by_person.setdefault(face.person_id, face)
    return list(by_person.values())[:count]
