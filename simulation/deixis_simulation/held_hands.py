"""Hands that are held while people point or do something else, as masks: what a perfect tracker would cut out.

To fit what tells a pointing from other gestures. The scenes are those of the clips (`draw.py`), so people, distances, lenses
and company are as there; only labels are rendered, which makes a hundred hands in the time of one clip.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M
from numpy.typing import NDArray

from .actor import Actor, Moment
from .draw import draw_scene
from .envelope import envelope_of
from .geometry import Floats, View, robot_at, view_at
from .gestures import TWO_HANDED
from .label_image import Labels, hand_mask
from .renderer import Renderer, Tints
from .scene import KINDS, ArmSide, Kind, Pointing, Quiet, QuietGesture, Scene
from .skeleton import SIDES
from .stage import window_of

MOMENTS = (0.25, 0.6, 0.9)
"""Of each stroke, shares of its time."""
LEAST_PX = 12
"""Hands of fewer visible pixels are nobody's to judge."""


@dataclass(frozen=True)
class HeldHand:
    """One hand in one moment of a stroke. hand (h, w), other (h, w): pixels seen of it and of the person's other hand;
    both from `corner_px` on. head_px: middle of the head; face_width_px: what the person's face measures there.
    """

    gesture: Literal["point"] | QuietGesture
    side: ArmSide
    hand: NDArray[np.bool_]
    other: NDArray[np.bool_]
    corner_px: tuple[int, int]
    head_px: Floats
    face_width_px: float


_Labelled = tuple[Labels, tuple[int, int]]
"""The label image around the people, and its corner."""


def held_hands(seed: int, indices: Iterable[int], kinds: Sequence[Kind] = KINDS) -> Iterator[HeldHand]:
    """The hands of scenes `indices` of a seed, of these kinds; the same for the same arguments. Raises RenderError."""
    for index in indices:
        scene = draw_scene(seed, index, [kind for kind in kinds if kind != "turn"])
        if scene.people:
            yield from _of_scene(scene)


def _of_scene(scene: Scene) -> Iterator[HeldHand]:
    actors = [Actor(person, scene, number) for number, person in enumerate(scene.people)]
    renderer = Renderer(scene.camera.width, scene.camera.height)
    try:
        for actor in actors:
            renderer.add_person(actor.avatar, Tints())
        for number, person in enumerate(scene.people):
            for action in person.actions:
                if isinstance(action, Pointing | Quiet):
                    yield from _of_action(scene, renderer, actors, number, action)
    finally:
        renderer.close()


def _of_action(
    scene: Scene, renderer: Renderer, actors: list[Actor], number: int, action: Pointing | Quiet
) -> Iterator[HeldHand]:
    envelope = envelope_of(action)
    gesture: Literal["point"] | QuietGesture = "point" if isinstance(action, Pointing) else action.gesture
    for share in MOMENTS:
        time_s = envelope.start_s + envelope.preparation_s + share * envelope.hold_s
        view = view_at(scene.camera, robot_at(scene.robot_path, time_s))
        moments = [actor.moment(time_s) for actor in actors]
        seen = _labels(renderer, actors, moments, view)
        if seen is None:
            continue
        for side in SIDES if gesture in TWO_HANDED else (action.arm,):
            held = _held(gesture, side, seen, number, actors[number], moments[number], view)
            if held is not None:
                yield held


def _labels(renderer: Renderer, actors: list[Actor], moments: list[Moment], view: View) -> _Labelled | None:
    meshes = [actor.mesh(moment) for actor, moment in zip(actors, moments, strict=True)]
    window = window_of(meshes, view)
    if window is None:
        return None
    renderer.pose(meshes)
    return renderer.labels(view.part(*window)), window[:2]


def _held(
    gesture: Literal["point"] | QuietGesture,
    side: ArmSide,
    seen: _Labelled,
    number: int,
    actor: Actor,
    moment: Moment,
    view: View,
) -> HeldHand | None:
    labels, corner = seen
    hand = hand_mask(labels, number, side)
    depth_m = float(view.in_camera(moment.head_centre)[2])
    if np.count_nonzero(hand) < LEAST_PX or depth_m <= 0:
        return None
    width_px = FACE_WIDTH_M * actor.body.head_scale * float(view.matrix[0, 0]) / depth_m
    other = hand_mask(labels, number, "left" if side == "right" else "right")
    return HeldHand(gesture, side, hand, other, corner, view.project(moment.head_centre), width_px)
