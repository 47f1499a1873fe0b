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


def subframes_for(motion_px: float) -> int:
    """How many pictures make the motion blur of a frame in which something moves so far while the shutter is open."""
    return next((count for limit, count in SUBFRAMES if motion_px < limit), MOST_SUBFRAMES)


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
        self._shadowed: list[NDArray[np.float32]] = []

    def close(self) -> None:
        """Give the renderer's memory back."""
        self._renderer.close()

    def picture(self, view: View, subframes: Sequence[Sequence[Mesh]]) -> FloatPicture:
        """Linear light (h, w, 3) RGB: the mean of the people's poses in `subframes` before the room."""
        self._look_at(view)
        if not self._scene.people:
            return self._room.copy()
        self._cast_shadows(subframes[len(subframes) // 2])
        people: FloatPicture | None = None
        for number, meshes in enumerate(subframes):
            self._renderer.pose(meshes)
            one = self._renderer.people(view, number)
            people = one if people is None else people + one
        assert people is not None
        room = shadows_on(self._room, self._renderer.shade(view))
        return over(people / np.float32(len(subframes)), room)

    def labels(self, view: View, meshes: Sequence[Mesh]) -> NDArray[np.uint8]:
        """Label picture (h, w), see Renderer.labels."""
        if meshes:
            self._renderer.pose(meshes)
        return self._renderer.labels(view)

    def _look_at(self, view: View) -> None:
        """Render the room without people's shadows, where the camera is at a new place."""
        same = self._view is not None and np.allclose(self._view.rotation, view.rotation, atol=1e-9)
        if same and self._view is not None and np.allclose(self._view.translation, view.translation, atol=1e-9):
            return
        self._view = view
        self._room = self._renderer.room(view, 1 if self._moves else 6)

    def _lamps_around(self) -> Floats:
        """The lamps hang where the people start; they do not follow them."""
        if not self._scene.people:
            return np.array((0.0, 0.0, -2.0))
        places = np.array([person.place_m for person in self._scene.people])
        x, y = places.mean(axis=0)
        return np.array((-y, 0.0, -x))

    def _cast_shadows(self, meshes: Sequence[Mesh]) -> None:
        now = [mesh.vertices[::97] for mesh in meshes]
        if self._shadowed and all(
            float(np.abs(a - b).max()) < SHADOWS_STAND_M for a, b in zip(now, self._shadowed, strict=True)
        ):
            return
        self._shadowed = [np.array(vertices) for vertices in now]
        self._renderer.pose(meshes)
        self._renderer.cast_people(*_ball(meshes))


def _ball(meshes: Sequence[Mesh]) -> tuple[Floats, float]:
    """Centre (world) and radius, metres, of a ball around the people."""
    middles = np.array([0.5 * (mesh.vertices.min(0) + mesh.vertices.max(0)) for mesh in meshes], float)
    low, high = middles.min(0), middles.max(0)
    centre = 0.5 * (low + high)
    apart = float(np.hypot(*(high - low)[[0, 2]])) / 2
    return np.array((centre[0], SHADOW_CENTRE_M, centre[2])), min(PERSON_RADIUS_M + apart, WIDEST_RADIUS_M)
