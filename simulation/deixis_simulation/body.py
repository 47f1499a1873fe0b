"""A body: an avatar brought to a height, with the lengths and directions of its bones. Children have larger heads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from .avatars import BONE_PREFIX, Avatar, Indices, Meshes32
from .geometry import Floats
from .rotations import unit
from .scene import ArmSide

FINGERS = ("Index", "Middle", "Ring", "Pinky")
HEAD_GROWTH = 0.23
"""Heads grow with this power of the height. Of children of 1.17 and 1.40 m (6 and 10 years) heads are 51.5 and 53.5 cm around,
of adults of 1.70 m 56 cm, and tall and short adults differ as little. Scaled with the body a child's head was a fifth too
small, and whoever measures distance by it was as far off.
"""


def head_size(height_m: float, own_height_m: float) -> float:
    """How large the head of a person of that height is, times that of the avatar at its own height."""
    return float((height_m / own_height_m) ** HEAD_GROWTH)


@dataclass(frozen=True, eq=False)
class Body:
    """T-pose of an avatar at a height, metres. `scale`, `head_scale`: times the packed size."""

    avatar: Avatar
    scale: float
    head_scale: float
    vertices: Meshes32
    joints: Floats
    morphs: dict[str, tuple[Indices, Meshes32]]

    def joint(self, bone: str) -> Floats:
        """Where a bone begins (3,)."""
        position: Floats = self.joints[self.avatar.bone_index[bone]]
        return position

    def direction(self, bone: str) -> Floats:
        """Unit vector (3,) of a bone of arm, hand or leg in the T-pose."""
        return self._directions[bone]

    def length(self, bone: str) -> float:
        """Length of a bone of arm, hand or leg."""
        return float(np.linalg.norm(self.joint(_NEXT[bone]) - self.joint(bone)))

    @cached_property
    def _directions(self) -> dict[str, Floats]:
        found = {bone: unit(self.joint(after) - self.joint(bone)) for bone, after in _NEXT.items()}
        for prefix in BONE_PREFIX.values():
            # The hand points where its index finger does.
            found[f"{prefix}Hand"] = unit(found[f"{prefix}HandIndex1"] + found[f"{prefix}HandIndex2"])
        return found

    @cached_property
    def eyes(self) -> Floats:
        """Middle between the eyes, at the cornea (3,)."""
        middle: Floats = (self.joint("RightEye") + self.joint("LeftEye")) / 2
        return middle + np.array([0.0, 0.0, 0.012]) * self.head_scale

    @cached_property
    def head_centre(self) -> Floats:
        """Middle of the skull (3,)."""
        return self.eyes + np.array([0.0, 0.005, -0.087]) * self.head_scale

    @cached_property
    def fingertip(self) -> dict[ArmSide, Floats]:
        """Tip of either index finger (3,)."""
        rows = self.avatar.fingertip_vertices
        return {side: self.vertices[rows[side]].mean(axis=0).astype(float) for side in rows}

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Bones below the hips, parents first."""
        found = [self.avatar.bone_index["Hips"]]
        for row in found:
            found.extend(np.flatnonzero(self.avatar.parent == row).tolist())
        return tuple(found)


def fit_body(avatar: Avatar, height_m: float) -> Body:
    """The avatar with that height, hair included."""
    pivot = avatar.joint("Head")
    own_height_m = float(avatar.vertices[:, 1].max())
    wanted = head_size(height_m, own_height_m)
    # The neck ends at `pivot`: below it the body has the height that the head leaves.
    factor = wanted * float(pivot[1]) / (height_m - wanted * (own_height_m - float(pivot[1])))
    below = _head_bones(avatar)
    share = head_share(avatar)[:, None]
    vertices = avatar.vertices + (factor - 1) * share * (avatar.vertices - pivot)
    joints = avatar.joints + (factor - 1) * below[:, None] * (avatar.joints - pivot)
    scale = height_m / float(vertices[:, 1].max())
    head_scale = scale * factor
    morphs = {name: (rows, offsets * np.float32(head_scale)) for name, (rows, offsets) in avatar.morphs.items()}
    return Body(avatar, scale, head_scale, (vertices * scale).astype(np.float32), joints * scale, morphs)


def head_share(avatar: Avatar) -> Floats:
    """How far each vertex goes with the head (n,), 0 to 1."""
    share: Floats = np.asarray(avatar.weights[:, np.flatnonzero(_head_bones(avatar))].sum(axis=1)).ravel()
    return share


def _head_bones(avatar: Avatar) -> Floats:
    """1 for the bones of the head (bones,)."""
    found = [avatar.bone_index["Head"]]
    for row in found:
        found.extend(np.flatnonzero(avatar.parent == row).tolist())
    below = np.zeros(len(avatar.bones))
    below[found] = 1.0
    return below


def _chain() -> dict[str, str]:
    """Bone -> the bone that begins at its end."""
    after = {}
    for prefix in BONE_PREFIX.values():
        limbs = ("Arm", "ForeArm", "Hand", "HandMiddle1"), ("UpLeg", "Leg", "Foot", "ToeBase")
        after.update({prefix + a: prefix + b for limb in limbs for a, b in pairwise(limb)})
        fingers = [f"{prefix}Hand{finger}" for finger in (*FINGERS, "Thumb")]
        after.update({f"{finger}{n}": f"{finger}{n + 1}" for finger in fingers for n in (1, 2, 3)})
    return after


_NEXT = _chain()
