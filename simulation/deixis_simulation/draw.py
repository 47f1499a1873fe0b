"""Scenes at random: scene `index` of a seed is the same wherever and in whatever order it is drawn.

Each part of a scene has its own stream of random numbers, so that one more number drawn in one leaves the others alone. What a
caller fixes (size, field of view) takes the place of what was drawn, after that was drawn: with another size it is the same
scene. With another field of view persons and camera may stand elsewhere, since they have to fit the picture.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .avatars import FITTING_AVATARS, HELD_OUT_AVATARS
from .dice import Dice
from .draw_bodies import draw_bodies
from .draw_layout import Layout, draw_layout
from .draw_lens import Overrides, draw_sensor, draw_size
from .draw_light import draw_light
from .draw_manner import ANYHOW
from .draw_plain import PLAIN
from .draw_plan import draw_plan
from .draw_room import draw_room
from .draw_stand import CAMERA
from .scene import KINDS, Kind, Place, Scene, Walk

FPS = 30
HELD_OUT_FROM_SEED = 1000
"""Seeds below are for fitting; from here on people are drawn whom nothing was fitted on."""
MAX_SEED = 2**32


def draw_scene(
    seed: int, index: int, kinds: Sequence[Kind] = KINDS, overrides: Overrides | None = None, *, plain: bool = False
) -> Scene:
    """Scene `index` of a seed, of one of these kinds; `plain`: without difficulties (`draw_plain.py`).

    Raises DrawingError where nothing fits the field of view asked for.
    """
    overrides, manner = overrides or Overrides(), PLAIN if plain else ANYHOW
    streams = [Dice(stream) for stream in np.random.default_rng([seed, index]).spawn(7)]
    first, bodies_dice, layout_dice, room_dice, light_dice, lens_dice, clip_dice = streams
    kind = first.weighed({kind: manner.plots.kinds[kind] for kind in KINDS if kind in kinds})
    plan = draw_plan(first, kind, manner.plots)
    bodies = draw_bodies(bodies_dice, avatars_of(seed), plan.people, manner.child_share)
    layout = draw_layout(layout_dice, plan, bodies, overrides, manner)
    width, height = draw_size(lens_dice, overrides, manner.optics)
    return Scene(
        name=scene_name(seed, index, kind, manner.letter),
        kind=kind,
        seed=clip_dice.whole(0, 2**31 - 1),
        duration_s=layout.duration_s,
        fps=FPS,
        camera=layout.camera.model_copy(update={"width": width, "height": height}),
        robot_path=layout.robot_path,
        sensor=draw_sensor(lens_dice, manner.optics),
        light=draw_light(light_dice, layout.duration_s, empty=plan.plot == "empty", lamps=manner.lamps),
        room=draw_room(room_dice, _reach(layout), manner.rooms),
        pois=layout.pois,
        people=layout.people,
    )


def avatars_of(seed: int) -> tuple[str, ...]:
    """The avatars that scenes of this seed are drawn from."""
    return FITTING_AVATARS if seed < HELD_OUT_FROM_SEED else HELD_OUT_AVATARS


def scene_name(seed: int, index: int, kind: Kind, letter: str) -> str:
    """Name of a drawn scene and its files."""
    return f"{letter}{seed:04d}_{index:03d}_{kind}"


def _reach(layout: Layout) -> list[Place]:
    """All that the room has to hold."""
    persons = [person.place_m for person in layout.people]
    ends = [action.to_m for person in layout.people for action in person.actions if isinstance(action, Walk)]
    pois = [(poi.position_m[0], poi.position_m[1]) for poi in layout.pois]
    robot = [(point.x_m, point.y_m) for point in layout.robot_path]
    return [CAMERA, *persons, *ends, *pois, *robot]
