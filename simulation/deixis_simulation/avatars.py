"""The packed people (`avatars_data`): mesh, bones, pictures; and which of them are held back from fitting."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import resources
from importlib.resources.abc import Traversable
from io import BytesIO

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .geometry import Floats
from .scene import ArmSide

Meshes32 = NDArray[np.float32]
Indices = NDArray[np.int32]
Picture = NDArray[np.uint8]
Mask = NDArray[np.bool_]

# Dark and light skin and both sexes stand in each; the two White_M_1 are one man, so they stay together.
FITTING_AVATARS: tuple[str, ...] = (
    "AIAN_F_1_Casual", "Black_F_1_Casual", "Black_M_3_Busi", "Hispanic_M_2_Casual",
    "MENA_F_1_Casual", "NHPI_M_2_Casual", "White_M_1_Busi", "White_M_1_Casual",
)  # fmt: skip
HELD_OUT_AVATARS: tuple[str, ...] = (
    "Asian_F_1_Casual", "Black_M_2_Casual", "Hispanic_F_1_Casual", "MENA_M_2_Casual", "White_F_1_Casual", "White_M_3_Casual",
)  # fmt: skip
WIGGED = "AIAN_F_1_Casual"
"""The fitting avatar whose hair is a wig, on a scalp of skin."""
AVATARS: tuple[str, ...] = tuple(sorted(FITTING_AVATARS + HELD_OUT_AVATARS))

HEAD, NECK, RIGHT_HAND, LEFT_HAND, RIGHT_ARM, LEFT_ARM, BODY = range(1, 8)
"""Parts of the label images (FORMAT.md)."""
HAND_PART: dict[ArmSide, int] = {"right": RIGHT_HAND, "left": LEFT_HAND}
BONE_PREFIX: dict[ArmSide, str] = {"right": "Right", "left": "Left"}
MORPHS = ("LeyeClose", "ReyeClose", "MouthOpen", "AE_AA", "UH_OO")
_EYE = 99


class AvatarError(ValueError):
    """An avatar that does not exist, or whose files are unusable; the text says which and why."""


@dataclass(frozen=True, eq=False)
class Avatar:
    """One person as packed: T-pose, Y up, faces +Z, metres, feet at Y = 0.

    vertices, normals (n, 3); texture_coordinates (n, 2), origin at the pictures' top left; triangles (m, 3); part (n,) as in
    the label images, eyes are head; is_eye, is_body (n,): eyeballs with their lashes; the body's mesh without eyes and wigs.
    colours, normal_map: RGB. skin_mask: 255 where the texel is skin. weights (n, bones) sum to 1 per vertex. bones, parent,
    joints: names, index of the parent (-1: none), positions (bones, 3). morphs: name -> (indices (k,), offsets (k, 3)).
    """

    name: str
    vertices: Meshes32
    normals: Meshes32
    texture_coordinates: Meshes32
    triangles: Indices
    part: Picture
    is_eye: Mask
    is_body: Mask
    colours: Picture
    normal_map: Picture
    skin_mask: Picture
    weights: sparse.csr_array
    bones: tuple[str, ...]
    parent: Indices
    joints: Floats
    morphs: dict[str, tuple[Indices, Meshes32]]

    @cached_property
    def bone_index(self) -> dict[str, int]:
        """Name of a bone -> its row."""
        return {name: row for row, name in enumerate(self.bones)}

    def joint(self, bone: str) -> Floats:
        """Where a bone begins (3,), in the T-pose."""
        position: Floats = self.joints[self.bone_index[bone]]
        return position

    @cached_property
    def eyes(self) -> Floats:
        """Middle between the eyeballs (3,)."""
        middle: Floats = (self.joint("RightEye") + self.joint("LeftEye")) / 2
        return middle

    @cached_property
    def head_vertices(self) -> Indices:
        """Vertices of the head, without eyeballs and wig."""
        return _rows((self.part == HEAD) & self.is_body)

    @cached_property
    def face_vertices(self) -> Indices:
        """Vertices of the face: chin to hairline, ear to ear, front half."""
        rows = self.head_vertices
        offset = self.vertices[rows] - self.eyes
        in_height = (offset[:, 1] > -0.125) & (offset[:, 1] < 0.065)
        return rows[in_height & (offset[:, 2] > -0.075) & (np.abs(offset[:, 0]) < 0.085)]

    @cached_property
    def is_hair(self) -> Mask:
        """Where the hair tint may act (n,): head that is neither face nor eye. Texels of `skin_mask` are to be left out."""
        hair: Mask = (self.part == HEAD) & ~self.is_eye
        hair[self.face_vertices] = False
        return hair

    @cached_property
    def hand_vertices(self) -> dict[ArmSide, Indices]:
        """Vertices of either hand."""
        return {side: _rows(self.part == part) for side, part in HAND_PART.items()}

    @cached_property
    def hand_weights(self) -> dict[ArmSide, Floats]:
        """Share of the hand's surface per vertex of `hand_vertices`; sums to 1. Fingertips have more vertices than area."""
        corners = self.vertices[self.triangles].astype(float)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 6
        per_vertex = np.bincount(self.triangles.ravel(), np.repeat(area, 3), len(self.vertices))
        return {side: per_vertex[rows] / per_vertex[rows].sum() for side, rows in self.hand_vertices.items()}

    @cached_property
    def fingertip_vertices(self) -> dict[ArmSide, Indices]:
        """The six outermost vertices of either index finger."""
        return {side: self._tip(prefix) for side, prefix in BONE_PREFIX.items()}

    def _tip(self, prefix: str) -> Indices:
        bones = [self.bone_index[f"{prefix}HandIndex{number}"] for number in (3, 4)]
        rows = _rows(np.asarray(self.weights[:, bones].sum(axis=1)).ravel() > 0.5)
        along = self.joint(f"{prefix}HandIndex4") - self.joint(f"{prefix}HandIndex3")
        return rows[np.argsort(self.vertices[rows] @ along)[-6:]]


@lru_cache(maxsize=len(AVATARS))
def load_avatar(name: str) -> Avatar:
    """The packed avatar of that name; loaded once. Raises AvatarError."""
    if name not in AVATARS:
        raise AvatarError(f"no avatar '{name}'; there are {', '.join(AVATARS)}")
    folder = resources.files(__package__) / "avatars_data"
    try:
        with np.load(BytesIO((folder / f"{name}.npz").read_bytes()), allow_pickle=False) as packed:
            arrays = {key: packed[key] for key in packed.files}
    except (OSError, ValueError) as error:
        raise AvatarError(f"avatar '{name}': {error}") from None
    return Avatar(
        name=name,
        vertices=arrays["vertices"],
        normals=(arrays["normals"] / np.float32(127)).astype(np.float32),
        texture_coordinates=arrays["texture_coordinates"],
        triangles=arrays["triangles"].astype(np.int32),
        part=np.where(arrays["part"] == _EYE, HEAD, arrays["part"]).astype(np.uint8),
        is_eye=arrays["part"] == _EYE,
        is_body=arrays["is_body"],
        colours=_picture(folder / f"{name}.webp"),
        normal_map=_picture(folder / f"{name}_normals.webp"),
        skin_mask=_picture(folder / f"{name}_skin.png")[..., 0],
        weights=_weights(arrays["bone_index"], arrays["bone_weight"], len(arrays["bones"])),
        bones=tuple(str(bone) for bone in arrays["bones"]),
        parent=arrays["parent"].astype(np.int32),
        joints=arrays["joints"].astype(float),
        morphs={morph: _morph(arrays, morph) for morph in MORPHS if f"morph_index_{morph}" in arrays},
    )


def _rows(mask: Mask) -> Indices:
    return np.flatnonzero(mask).astype(np.int32)


def _picture(path: Traversable) -> Picture:
    picture = cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise AvatarError(f"'{path}' is not a picture")
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)


def _weights(bone: NDArray[np.uint8], weight: NDArray[np.uint16], bones: int) -> sparse.csr_array:
    share = weight / np.maximum(weight.sum(axis=1, keepdims=True, dtype=np.int64), 1)
    rows = np.repeat(np.arange(len(bone)), bone.shape[1])
    matrix = sparse.csr_array(
        (share.ravel().astype(np.float32), (rows, bone.ravel().astype(np.int32))), shape=(len(bone), bones)
    )
    matrix.eliminate_zeros()
    return matrix


def _morph(arrays: dict[str, NDArray], name: str) -> tuple[Indices, Meshes32]:
    return arrays[f"morph_index_{name}"].astype(np.int32), arrays[f"morph_offset_{name}"].astype(np.float32)
