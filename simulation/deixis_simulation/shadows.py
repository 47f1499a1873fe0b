"""Shadow maps of all lamps in one texture: what each lamp sees, one square tile a lamp."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from .geometry import Floats
from .lights import MAX_LAMPS, Lamp

TILE_PX = 512
TILES = 4
"""Tiles along either side, so many times itself lamps."""
assert MAX_LAMPS <= TILES * TILES
USUAL_RADIUS_M = 1.3
"""Radius that the softness of a lamp is given for."""
WIDEST = 0.93
"""Sine of the widest half angle of a lamp's view."""


class ShadowAtlas:
    """Depth from the lamps toward a ball; outside of it nothing lies in shadow."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        texture = context.depth_texture((TILE_PX * TILES, TILE_PX * TILES))
        texture.compare_func, texture.filter = "<=", (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        self._target = context.framebuffer(depth_attachment=texture)
        self.texture = texture
        self.matrices: list[Floats] = []
        self.softness: list[float] = []
        self.raised_m = 0.0

    def draw(
        self, program: Any, lamps: Sequence[Lamp], centre: Floats, radius_m: float, casting: Sequence[moderngl.VertexArray]
    ) -> None:
        """Draw what casts shadows in the ball around `centre` (world) with a program that writes depth alone."""
        self._target.use()
        self._target.clear(depth=1.0)
        zooms = [_zoom(lamp.position, centre, radius_m) for lamp in lamps]
        self.matrices = [_lamp_matrix(lamp.position, centre, radius_m) for lamp in lamps]
        # Softness is a share of the tile; a wider view makes the same lamp a smaller share.
        usual = [_zoom(lamp.position, centre, USUAL_RADIUS_M) for lamp in lamps]
        self.softness = [lamp.softness * zoom / was for lamp, zoom, was in zip(lamps, zooms, usual, strict=True)]
        self.raised_m = 0.012 * max(1.0, radius_m / USUAL_RADIUS_M)
        for number, matrix in enumerate(self.matrices):
            self._context.viewport = (number % TILES * TILE_PX, number // TILES * TILE_PX, TILE_PX, TILE_PX)
            program["view_projection"].write(np.ascontiguousarray(matrix.T, "f4").tobytes())
            for drawn in casting:
                drawn.render()


def coarse_triangles(vertices: NDArray[Any], triangles: NDArray[Any], part: NDArray[Any], cell_m: float) -> NDArray[np.int32]:
    """Fewer triangles (k, 3) of the same vertices (n, 3): those of one part within a cell count as one. For shadows."""
    cells = np.floor(np.asarray(vertices, float) / cell_m).astype(np.int64)
    _, first, group = np.unique(np.column_stack([cells, part]), axis=0, return_index=True, return_inverse=True)
    merged = first[group.ravel()][np.asarray(triangles, np.int64)]
    a, b, c = merged.T
    whole = (a != b) & (b != c) & (c != a)
    return np.unique(np.sort(merged[whole], axis=1), axis=0).astype(np.int32)


def _zoom(position: Floats, centre: Floats, radius_m: float) -> float:
    distance = float(np.linalg.norm(np.asarray(centre, float) - position))
    return float(1 / np.tan(np.arcsin(min(radius_m / distance, WIDEST))))


def _lamp_matrix(position: Floats, centre: Floats, radius_m: float) -> Floats:
    """A lamp looks at the ball as a camera would; the cone just holds it, or is as wide as it may be."""
    ahead = np.asarray(centre, float) - position
    distance = float(np.linalg.norm(ahead))
    ahead = ahead / distance
    up = np.array((0.0, 1.0, 0.0)) if abs(ahead[1]) < 0.95 else np.array((0.0, 0.0, 1.0))
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(ahead, right), ahead])
    near, far = max(0.3, distance - 1.3 * radius_m), distance + 2.2 * radius_m
    projection = np.zeros((4, 4))
    projection[0, 0] = projection[1, 1] = _zoom(position, centre, radius_m)
    projection[2, 2], projection[2, 3] = (far + near) / (far - near), -2 * far * near / (far - near)
    projection[3, 2] = 1
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, -rotation @ position
    return np.asarray(projection @ pose)
