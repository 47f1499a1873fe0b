"""Points of interest around a person, and what stands there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .bearings import heading_to, off_line_m, place_at
from .dice import Dice
from .scene import ExhibitKind, Place, ScenePoi

COUNT = (3, 12)
MIN_GAP_DEG = 10.0
CLEARANCE_M = 0.55
"""Between an exhibit and where people stand or walk, or what the camera sees them through."""
EXHIBITS: tuple[ExhibitKind, ...] = ("vase", "sphere", "cube", "cup", "bust", "picture")


@dataclass(frozen=True)
class Spread:
    """Where POIs are: within `within_deg` of the direction to the camera, to either side; distance and height from, to.
    gaps_deg: all around at one of these gaps; where there are none, COUNT of them at any gap from MIN_GAP_DEG.
    What stands there is seen of POIs `seen_from_deg` and more off the direction to the camera, `seen_gap_deg` from each other,
    and in scenes in which nobody points only where `always_seen`.
    """

    within_deg: float = 145.0
    gaps_deg: tuple[float, ...] = ()
    distance_m: tuple[float, float] = (1.0, 4.0)
    height_m: tuple[float, float] = (0.3, 2.0)
    bare_share: float = 0.08
    seen_from_deg: float = 0.0
    seen_gap_deg: float = 0.0
    always_seen: bool = True


ANY_SPREAD = Spread()


def draw_pois(
    dice: Dice, person: Place, camera: Place, keep_free: Sequence[tuple[Place, Place]], spread: Spread = ANY_SPREAD
) -> list[ScenePoi]:
    """POIs P1, P2, ... by azimuth. Nothing is drawn of one that would stand in the ways `keep_free` (from, to)."""
    toward, last_seen = heading_to(person, camera), -360.0
    pois = []
    for number, azimuth in enumerate(_draw_azimuths(dice, spread), 1):
        x, y = place_at(person, toward + azimuth, dice.between(*spread.distance_m))
        kind, bare = dice.one(EXHIBITS), dice.chance(spread.bare_share)
        may_stand = abs(azimuth) >= spread.seen_from_deg and azimuth - last_seen >= spread.seen_gap_deg
        stands = not bare and may_stand and all(off_line_m((x, y), *way) >= CLEARANCE_M for way in keep_free)
        last_seen = azimuth if stands else last_seen
        pois.append(
            ScenePoi(
                poi_id=f"P{number}",
                position_m=(round(x, 3), round(y, 3), dice.between(*spread.height_m)),
                exhibit=kind if stands else None,
                tone=(dice.whole(20, 220), dice.whole(20, 220), dice.whole(20, 220)),
            )
        )
    return pois


def _draw_azimuths(dice: Dice, spread: Spread) -> list[float]:
    """Sorted azimuths."""
    return _draw_ring(dice, spread) if spread.gaps_deg else _draw_scattered(dice, spread.within_deg)


def _draw_ring(dice: Dice, spread: Spread) -> list[float]:
    """All around at one gap, from anywhere on."""
    gap = dice.one(spread.gaps_deg)
    first = -spread.within_deg + dice.between(0, gap)
    return [first + gap * number for number in range(int((spread.within_deg - first) / gap) + 1)]


def _draw_scattered(dice: Dice, within_deg: float) -> list[float]:
    """None nearer to the next than MIN_GAP_DEG, some as near as that."""
    count = dice.whole(*COUNT)
    spare = 2 * within_deg - MIN_GAP_DEG * (count - 1)
    # A crowded site has its POIs in one part of the circle, so that small gaps are as usual as large ones.
    used = spare * dice.between(0.1, 1.0)
    shifts = sorted(dice.between(0, used) for _ in range(count))
    start = -within_deg + dice.between(0, spare - used)
    return [start + shift + MIN_GAP_DEG * number for number, shift in enumerate(shifts)]
