"""Truth of a clip, frame by frame, as `FORMAT.md` of the rendered clips has it. Pixels, metres, degrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .actor import Moment
from .avatars import Avatar
from .geometry import RobotState, View, to_world, wrap_deg
from .label_image import Labels, face_mask, hand_mask, region_of
from .scene import ArmSide, Scene
from .truth_arm import arm_truth, hand_truth
from .truth_camera import labels_origin, pose_truth, robot_truth, user_truth
from .truth_head import azimuth_deg, face_truth, head_truth, toward_camera_deg

SIDES: tuple[ArmSide, ...] = ("left", "right")


@dataclass(frozen=True)
class Seen:
    """A person at mid-exposure: what it does, and its surface (n, 3) in the world."""

    avatar: Avatar
    moment: Moment
    vertices: NDArray[np.float32]


class TruthWriter:
    """Writes the truth of the frames of one clip, in order: the speed of a hand is taken from the frame before."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._origin = labels_origin(scene)
        self._targets = {poi.poi_id: to_world(poi.position_m) for poi in scene.pois}
        self._hands: dict[tuple[int, ArmSide], list[float]] = {}

    def frame(
        self, number: int, view: View, robot: RobotState, persons: Sequence[Seen], labels: Labels, light_gain: float
    ) -> dict[str, Any]:
        """One entry of `frames`. `labels` (h, w) is the label image of the same moment."""
        moving = {"camera": pose_truth(view, self._origin), "robot": robot_truth(robot)} if self._scene.robot_path else {}
        return {
            "frame": number,
            "t": round(number / self._scene.fps, 4),
            "persons": [self._person(index, seen, view, labels) for index, seen in enumerate(persons)],
            "light_gain": round(light_gain, 4),
            **moving,
        }

    def _person(self, index: int, seen: Seen, view: View, labels: Labels) -> dict[str, Any]:
        moment, avatar = seen.moment, seen.avatar
        toward = toward_camera_deg(moment.head_centre, view)
        return {
            "id": index,
            "phase": moment.phase,
            "gesture": moment.gesture,
            "nonpoint_phase": None if moment.nonpoint_phase == "none" else moment.nonpoint_phase,
            **self._target(moment, toward),
            "head": head_truth(moment.head_rotation, moment.head_centre, moment.eyes, view),
            "face": face_truth(
                np.asarray(seen.vertices[avatar.face_vertices], float),
                np.asarray(seen.vertices[avatar.head_vertices], float),
                region_of(face_mask(labels, index)),
                view,
            ),
            "hands": {side: self._hand(index, seen, side, view, labels) for side in SIDES},
            "arm": arm_truth(moment, toward),
            "user_pos": user_truth(moment.head_centre, view, self._origin),
        }

    def _target(self, moment: Moment, toward_deg: float) -> dict[str, Any]:
        if moment.poi is None:
            return {"poi": None, "poi_azimuth_deg": None, "poi_image_side": None}
        way = self._targets[moment.poi] - moment.head_centre
        azimuth = round(wrap_deg(azimuth_deg(way) - toward_deg), 2)
        return {"poi": moment.poi, "poi_azimuth_deg": azimuth, "poi_image_side": "right" if azimuth > 0 else "left"}

    def _hand(self, index: int, seen: Seen, side: ArmSide, view: View, labels: Labels) -> dict[str, Any]:
        avatar = seen.avatar
        before = self._hands.get((index, side))
        surface = np.asarray(seen.vertices[avatar.hand_vertices[side]], float)
        region = region_of(hand_mask(labels, index, side))
        truth = hand_truth(seen.moment, side, surface, avatar.hand_weights[side], region, view, before)
        self._hands[index, side] = truth["center_px"]
        return truth
