"""Where pictures of made-up people are taken: empty rooms to put behind them, and light that falls on them from anywhere."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from .avatars import Picture
from .dice import Dice
from .draw import HELD_OUT_FROM_SEED, draw_scene
from .draw_lens import Overrides, draw_sensor
from .geometry import robot_at, view_at
from .lights import lighting
from .renderer import FloatPicture, Renderer
from .scene import Light, Scene
from .sensor import SensorModel
from .skeleton import Skeleton
from .skinning import Mesh
from .stage import Stage

ROOM_SIZE = (320, 240)


def draw_rooms(rng: np.random.Generator, count: int) -> list[Scene]:
    """Scenes whose empty rooms, lights and cameras pictures are taken in; of fitting seeds."""
    seeds = rng.choice(HELD_OUT_FROM_SEED, count, replace=False)
    return [draw_scene(int(seed), 0, overrides=Overrides(size=ROOM_SIZE)) for seed in seeds]


def empty_room(scene: Scene) -> FloatPicture:
    """Linear light (h, w, 3) of a scene without its people. Raises RenderError."""
    stage = Stage(scene.model_copy(update={"people": []}), [])
    try:
        return stage.picture(view_at(scene.camera, robot_at(scene.robot_path, 0.0)), [])
    finally:
        stage.close()


def behind(rng: np.random.Generator, rooms: Sequence[FloatPicture], side_px: int) -> FloatPicture:
    """A square part (side_px, side_px, 3) of one of these rooms, darker or brighter."""
    room = rooms[int(rng.integers(len(rooms)))]
    side = int(rng.integers(min(side_px, *room.shape[:2]) // 2, min(room.shape[:2])))
    top, left = (int(rng.integers(0, size - side + 1)) for size in room.shape[:2])
    part = room[top : top + side, left : left + side] * np.float32(rng.uniform(0.3, 1.5))
    return np.asarray(cv2.resize(part, (side_px, side_px), interpolation=cv2.INTER_AREA), np.float32)


def room_pictures(rng: np.random.Generator, count: int) -> list[Picture]:
    """So many rooms without people, as cameras take them (h, w, 3) BGR. Raises RenderError."""
    pictures = []
    for scene in draw_rooms(rng, count):
        camera = SensorModel(scene.model_copy(update={"sensor": draw_sensor(Dice(rng))}))
        light = empty_room(scene)
        camera.meter(light)
        pictures.append(camera.expose(light, 0, float(rng.uniform(0.6, 1.5))))
    return pictures


def draw_camera(scene: Scene, dice: Dice, side_px: int) -> SensorModel:
    """A camera whose pictures are squares of that size."""
    size = {"width": side_px, "height": side_px}
    camera = scene.camera.model_copy(update=size)
    return SensorModel(scene.model_copy(update={"camera": camera, "sensor": draw_sensor(dice)}))


def light_person(renderer: Renderer, light: Light, dice: Dice, skeleton: Skeleton, mesh: Mesh) -> None:
    """Pose one person in that light, with its shadows on itself."""
    # Lamps stand around the person as it faces; cameras go all the way round, so light comes from anywhere.
    place = (dice.between(-1.5, 1.5), 0.0, dice.between(-1.5, 1.5))
    renderer.light(lighting(light, place), np.zeros(3))
    renderer.pose([mesh])
    renderer.cast_people(skeleton.position("Head") - np.array([0.0, 0.3, 0.0]), 0.9)
