"""Points of interest around a person, and what stands there."""

from __future__ import annotations

from collections.abc import Sequence

from .bearings import heading_to, off_line_m, place_at
from .dice import Dice
from .scene import ExhibitKind, Place, ScenePoi

COUNT = (3, 12)
MIN_GAP_DEG = 10.0
SPREAD_DEG = 145.0
"""POIs lie within this of the direction to the camera, to either side."""
DISTANCE_M = (1.0, 4.0)
HEIGHT_M = (0.3, 2.0)
CLEARANCE_M = 0.55
"""Between an exhibit and where people stand or walk, or what the camera sees them through."""
BARE_SHARE = 0.08
EXHIBITS: tuple[ExhibitKind, ...] = ("vase", "sphere", "cube", "cup", "bust", "picture")


def draw_pois(dice: Dice, person: Place, camera: Place, keep_free: Sequence[tuple[Place, Place]]) -> list[ScenePoi]:
    """POIs P1, P2, ... by azimuth. Nothing is drawn of one that would stand in the ways `keep_free` (from, to)."""
    toward = heading_to(person, camera)
    pois = []
    for number, azimuth in enumerate(_draw_azimuths(dice), 1):
        x, y = place_at(person, toward + azimuth, dice.between(*DISTANCE_M))
        kind, bare = dice.one(EXHIBITS), dice.chance(BARE_SHARE)
        stands = not bare and all(off_line_m((x, y), *way) >= CLEARANCE_M for way in keep_free)
        pois.append(
            ScenePoi(
                poi_id=f"P{number}",
                position_m=(round(x, 3), round(y, 3), dice.between(*HEIGHT_M)),
                exhibit=kind if stands else None,
                tone=(dice.whole(20, 220), dice.whole(20, 220), dice.whole(20, 220)),
            )
        )
    return pois


def _draw_azimuths(dice: Dice) -> list[float]:
    """Sorted azimuths, none nearer to the next than MIN_GAP_DEG, some as near as that."""
    count = dice.whole(*COUNT)
    spare = 2 * SPREAD_DEG - MIN_GAP_DEG * (count - 1)
    # A crowded site has its POIs in one part of the circle, so that small gaps are as usual as large ones.
    used = spare * dice.between(0.1, 1.0)
    shifts = sorted(dice.between(0, used) for _ in range(count))
    start = -SPREAD_DEG + dice.between(0, spare - used)
    return [start + shift + MIN_GAP_DEG * number for number, shift in enumerate(shifts)]
