"""Scenes of a rehearsal: at each place somebody points at each POI that is not hidden there, and somebody does not point."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import cycle, islice

import numpy as np

from ..bearings import heading_to
from ..dice import Dice
from ..draw_actions import Target, draw_pointing, draw_quiet
from ..draw_bodies import draw_bodies
from ..draw_lens import draw_sensor
from ..draw_light import draw_light
from ..draw_room import draw_room
from ..geometry import wrap_deg
from ..scene import ExhibitKind, Person, Pointing, Quiet, Room, Scene, ScenePoi, Tone
from .aims import Aim
from .ground import MOST_WALLS_DRAWN, Ground, GroundPoi, Point, Wall
from .places import Place

START_S = 1.0
LONGEST_HOLD_S = 2.1
TAIL_S = 0.9
"""After the hand is down: the answer is given a moment after the stroke."""
TURNED_FROM_DEG = 100.0
"""People turn the body toward what lies farther to the side than this."""
HIGHEST_CEILING_M = 20.0
LEAST_FRONT_M = 4.0
"""The wall behind the people is at least so far from the camera."""

WORDS: dict[ExhibitKind, tuple[str, ...]] = {
    "vase": ("vase", "plant", "flower", "lamp", "urn", "pot"),
    "sphere": ("sphere", "globe", "ball", "planet"),
    "bust": ("bust", "statue", "figure", "sculpture", "head"),
    "cup": ("cup", "bowl", "mug", "guest book", "goblet"),
    "picture": ("picture", "painting", "poster", "clock", "map", "screen", "photo", "window", "mirror"),
    "cube": (),
}
"""What is drawn for a POI whose name holds one of the words; a cube for all others."""
TONES: tuple[Tone, ...] = ((70, 95, 150), (150, 120, 60), (90, 130, 90), (140, 70, 70), (110, 110, 120), (180, 170, 150))


@dataclass(frozen=True)
class Trial:
    """One clip of a rehearsal. `aim`: what is pointed at; none: the person does not point."""

    place: Place
    aim: Aim | None
    scene: Scene

    @property
    def words(self) -> str:
        """Place and POI, in a few words."""
        return f"{self.place.letter}, {self.aim.poi.name if self.aim is not None else 'no pointing'}"


def plan_trials(ground: Ground, aims: Sequence[Aim], *, count: int, seed: int, avatars: Sequence[str]) -> list[Trial]:
    """`count` people for each POI that is not hidden, at each place, and one who does not point at each place.

    In rounds, so that a rehearsal that is broken off has tried all of it a little. The same arguments give the same scenes.
    """
    shown = [aim for aim in aims if aim.hidden is None]
    places = list(dict.fromkeys(aim.place for aim in aims))
    first, rest = [(aim.place, aim) for aim in shown], [(aim.place, aim) for aim in shown] * (count - 1)
    quiet: list[tuple[Place, Aim | None]] = [(place, None) for place in places]
    wanted = [*first, *quiet, *rest]
    crowd = islice(cycle(_shuffled(avatars, seed)), len(wanted))
    return [_trial(ground, place, aim, who, seed, i) for i, ((place, aim), who) in enumerate(zip(wanted, crowd, strict=True))]


def _trial(ground: Ground, place: Place, aim: Aim | None, avatar: str, seed: int, number: int) -> Trial:
    dice = Dice(np.random.default_rng([seed, number]))
    body = draw_bodies(dice, [avatar], 1)[0]
    heading = _heading_deg(ground, place, aim, dice)
    action = _action(dice, ground, place, aim, heading)
    duration_s = round(action.end_s + TAIL_S, 2)
    scene = Scene(
        kind="point" if aim is not None else "quiet",
        seed=dice.whole(0, 2**31),
        duration_s=duration_s,
        fps=ground.fps,
        camera=ground.camera,
        sensor=draw_sensor(dice),
        light=draw_light(dice, duration_s, empty=False),
        room=draw_site_room(dice, ground),
        pois=[_scene_poi(poi, i) for i, poi in enumerate(ground.pois)],
        people=[Person(**asdict(body), place_m=place.position_m, heading_deg=heading, actions=[action])],
    )
    return Trial(place, aim, _with_name(scene, place, aim))


def _heading_deg(ground: Ground, place: Place, aim: Aim | None, dice: Dice) -> float:
    """About toward the camera; turned toward what lies far to the side, as an arm reaches only so far."""
    azimuth = aim.azimuth_deg if aim is not None else 0.0
    turn = np.sign(azimuth) * max(0.0, abs(azimuth) - TURNED_FROM_DEG)
    facing = heading_to(place.position_m, ground.camera_foot)
    return round(wrap_deg(facing + float(turn) + dice.near(0, 8, -15, 15, 1)), 1)


def _action(dice: Dice, ground: Ground, place: Place, aim: Aim | None, heading_deg: float) -> Pointing | Quiet:
    if aim is None:
        return draw_quiet(dice, START_S)
    front = wrap_deg(heading_deg - heading_to(place.position_m, ground.camera_foot))
    return draw_pointing(dice, START_S, Target(aim.poi.poi_id, wrap_deg(aim.azimuth_deg - front)), LONGEST_HOLD_S)


def draw_site_room(dice: Dice, ground: Ground) -> Room:
    """A room around all that stands in the site, with the site's own walls within it.

    Painted light: a site file does not say how its walls look, and what skin-like ones do is no matter of its layout.
    """
    reach: list[Point] = [(0.0, 0.0), ground.camera_foot, (ground.camera_foot[0] + LEAST_FRONT_M, 0.0)]
    reach += [poi.on_floor for poi in ground.pois] + [_bounded(end) for wall in ground.walls for end in wall]
    room = draw_room(dice, reach)
    highest = max(poi.position_m[2] for poi in ground.pois) + 0.5
    ceiling = min(max(room.ceiling_m, highest), HIGHEST_CEILING_M)
    light = dice.whole(150, 225)
    paint = light, light - dice.whole(0, 8), light - dice.whole(0, 16)
    changes = {
        "walls": _drawn_walls(ground.walls),
        "ceiling_m": ceiling,
        "wall": "plaster",
        "wall_tone": paint,
        "side_tone": paint,
    }
    return room.model_copy(update=changes)


def _drawn_walls(walls: Sequence[Wall]) -> list[Wall]:
    """Those nearest to the robot; a scene holds so many. Ends beyond what a scene can hold are brought in."""
    nearest = sorted(walls, key=lambda wall: min(x * x + y * y for x, y in wall))[:MOST_WALLS_DRAWN]
    return [(_bounded(a), _bounded(b)) for a, b in nearest]


def _bounded(point: Point) -> Point:
    return min(max(point[0], -95.0), 95.0), min(max(point[1], -95.0), 95.0)


def _scene_poi(poi: GroundPoi, number: int) -> ScenePoi:
    lowered = f"{poi.name} {poi.poi_id}".lower()
    fitting = (kind for kind, words in WORDS.items() if any(word in lowered for word in words))
    kind: ExhibitKind = next(fitting, "cube")
    tone = TONES[number % len(TONES)]
    return ScenePoi(poi_id=poi.poi_id, position_m=poi.position_m, name=poi.name[:200], exhibit=kind, tone=tone)


def _with_name(scene: Scene, place: Place, aim: Aim | None) -> Scene:
    """Named for what it shows and for its content: a clip of another scene never passes for it."""
    digest = hashlib.sha256(scene.model_dump_json().encode()).hexdigest()[:10]
    shows = aim.poi.poi_id if aim is not None else "quiet"
    return scene.model_copy(update={"name": f"{place.letter}_{shows}_{digest}"})


def _shuffled(avatars: Sequence[str], seed: int) -> list[str]:
    return [avatars[i] for i in np.random.default_rng(seed).permutation(len(avatars))]
