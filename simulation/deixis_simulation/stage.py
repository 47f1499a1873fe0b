"""A scene's room with its people, ready to be looked at: from posed meshes to linear light and labels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .avatars import Avatar
from .geometry import Floats, View
from .lights import lighting
from .renderer import FloatPicture, Renderer, Tints, over, shadows_on
from .room import build_room
from .scene import Scene
from .skinning import Mesh

SHADOW_CENTRE_M = 1.05
"""Height of the middle of what casts shadows."""
PERSON_RADIUS_M, WIDEST_RADIUS_M = 1.3, 4.0
"""Of the ball in which people cast shadows: of one person, and of people who stand far apart."""
SHADOWS_STAND_M = 0.004
"""Below this motion of any vertex the shadow maps of the last frame are good enough."""
SUBFRAMES = ((1.0, 1), (3.0, 2), (12.0, 4))
"""Motion blur: up to so many pixels of motion within the exposure, so many pictures are averaged; MOST beyond."""
MOST_SUBFRAMES = 6
NEAREST_M = 0.1
EDGE_PX, STEP_PX = 3, 32
"""Margin around people, and the grain of the window that is rendered around them."""


def subframes_for(motion_px: float) -> int:
    """How many pictures make the motion blur of a frame in which something moves so far while the shutter is open."""
    return next((count for limit, count in SUBFRAMES if motion_px < limit), MOST_SUBFRAMES)


def window_of(meshes: Sequence[Mesh], view: View) -> tuple[int, int, int, int] | None:
    """Left, top, width, height (pixels) of the part of the picture that people are in; none where they are not in it."""
    if not meshes:
        return None
    points = view.in_camera(np.vstack([mesh.vertices for mesh in meshes]))
    seen = points[points[:, 2] > NEAREST_M] @ view.matrix.T
    if len(seen) < len(points):
        return 0, 0, view.width, view.height
    places = seen[:, :2] / seen[:, 2:]
    # Whole steps: a renderer keeps its memory by size, and there should not be hundreds of sizes.
    low = np.maximum(np.floor((places.min(0) - EDGE_PX) / STEP_PX) * STEP_PX, 0).astype(int)
    high = np.minimum(np.ceil((places.max(0) + EDGE_PX) / STEP_PX) * STEP_PX, (view.width, view.height)).astype(int)
    width, height = high - low
    return (int(low[0]), int(low[1]), int(width), int(height)) if width > 0 and height > 0 else None


class Stage:
    """Renders one scene frame by frame. The room is rendered once for each place of the camera."""

    def __init__(self, scene: Scene, looks: Sequence[Avatar]) -> None:
        """`looks` are those of the scene's people, in order. Raises RenderError."""
        self._scene = scene
        self._renderer = Renderer(scene.camera.width, scene.camera.height)
        self._renderer.add_room(build_room(scene))
        for look, person in zip(looks, scene.people, strict=True):
            self._renderer.add_person(look, Tints(person.skin_tint, person.hair_tint, person.clothes_tint))
        lamps_around = self._lamps_around()
        self._renderer.light(lighting(scene.light, lamps_around), lamps_around + np.array((0.0, SHADOW_CENTRE_M, 0.0)))
        self._moves = len(scene.robot_path) > 1
        self._view: View | None = None
        self._room: FloatPicture
        self._shaded: FloatPicture
        self._shadowed: list[NDArray[np.float32]] = []

    def close(self) -> None:
        """Give the renderer's memory back."""
        self._renderer.close()

    def picture(self, view: View, subframes: Sequence[Sequence[Mesh]]) -> FloatPicture:
        """Linear light (h, w, 3) RGB: the mean of the people's poses in `subframes` before the room."""
        self._look_at(view)
        if not self._scene.people:
            return self._room.copy()
        self._cast_shadows(view, subframes[len(subframes) // 2])
        picture = self._shaded.copy()
        window = window_of([mesh for meshes in subframes for mesh in meshes], view)
        if window is None:
            return picture
        part = view.part(*window)
        people = np.zeros((part.height, part.width, 4), np.float32)
        for number, meshes in enumerate(subframes):
            self._renderer.pose(meshes)
            people += self._renderer.people(part, number)
        left, top, width, height = window
        inside = picture[top : top + height, left : left + width]
        inside[:] = over(people / np.float32(len(subframes)), inside)
        return picture

    def labels(self, view: View, meshes: Sequence[Mesh]) -> NDArray[np.uint8]:
        """Label picture (h, w), see Renderer.labels."""
        labels = np.zeros((view.height, view.width), np.uint8)
        window = window_of(meshes, view)
        if window is not None:
            self._renderer.pose(meshes)
            left, top, width, height = window
            labels[top : top + height, left : left + width] = self._renderer.labels(view.part(*window))
        return labels

    def _look_at(self, view: View) -> None:
        """Render the room without people's shadows, where the camera is at a new place."""
        same = self._view is not None and np.allclose(self._view.rotation, view.rotation, atol=1e-9)
        if same and self._view is not None and np.allclose(self._view.translation, view.translation, atol=1e-9):
            return
        self._view = view
        self._room = self._renderer.room_at_once(view) if self._moves else self._renderer.room(view)
        self._shaded = self._room
        self._shadowed = []

    def _lamps_around(self) -> Floats:
        """The lamps hang where the people start; they do not follow them."""
        if not self._scene.people:
            return np.array((0.0, 0.0, -2.0))
        places = np.array([person.place_m for person in self._scene.people])
        x, y = places.mean(axis=0)
        return np.array((-y, 0.0, -x))

    def _cast_shadows(self, view: View, meshes: Sequence[Mesh]) -> None:
        now = [mesh.vertices[::97] for mesh in meshes]
        if self._shadowed and all(
            float(np.abs(a - b).max()) < SHADOWS_STAND_M for a, b in zip(now, self._shadowed, strict=True)
        ):
            return
        self._shadowed = [np.array(vertices) for vertices in now]
        self._renderer.pose(meshes)
        self._renderer.cast_people(*_ball(meshes))
        self._shaded = shadows_on(self._room, self._renderer.shade(view))


def _ball(meshes: Sequence[Mesh]) -> tuple[Floats, float]:
    """Centre (world) and radius, metres, of a ball around the people."""
    middles = np.array([0.5 * (mesh.vertices.min(0) + mesh.vertices.max(0)) for mesh in meshes], float)
    low, high = middles.min(0), middles.max(0)
    centre = 0.5 * (low + high)
    apart = float(np.hypot(*(high - low)[[0, 2]])) / 2
    return np.array((centre[0], SHADOW_CENTRE_M, centre[2])), min(PERSON_RADIUS_M + apart, WIDEST_RADIUS_M)
