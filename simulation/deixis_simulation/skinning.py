"""Linear blend skinning: the mesh of a skeleton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .avatars import Meshes32
from .body import Body
from .skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Mesh:
    """Vertices (n, 3), metres, and unit normals (n, 3), in the frame of the skeleton. Triangles and textures: the avatar's."""

    vertices: Meshes32
    normals: Meshes32


def skin(skeleton: Skeleton, morphs: dict[str, float]) -> Mesh:
    """The mesh: each vertex goes with its bones by their weights. `morphs`: name -> share, unknown names are left out."""
    body = skeleton.body
    shifts = skeleton.positions - np.einsum("bij,bj->bi", skeleton.rotations, body.joints)
    bones = np.concatenate([skeleton.rotations, shifts[:, :, None]], axis=2).astype(np.float32)
    blended = (body.avatar.weights @ bones.reshape(-1, 12)).reshape(-1, 3, 4)
    points = _morphed(body, morphs)
    vertices = np.matmul(blended[:, :, :3], points[:, :, None])[..., 0] + blended[:, :, 3]
    normals = np.matmul(blended[:, :, :3], body.avatar.normals[:, :, None])[..., 0]
    normals /= np.maximum(np.sqrt(np.einsum("vi,vi->v", normals, normals)), np.float32(1e-6))[:, None]
    return Mesh(vertices, normals)


def _morphed(body: Body, morphs: dict[str, float]) -> Meshes32:
    wanted = {name: share for name, share in morphs.items() if share and name in body.morphs}
    if not wanted:
        return body.vertices
    points = body.vertices.copy()
    for name, share in wanted.items():
        rows, offsets = body.morphs[name]
        points[rows] += np.float32(share) * offsets
    return points
