"""Lamps and windows, and what they do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .dice import Dice
from .scene import Light, LightChange, LightPreset


@dataclass(frozen=True)
class Lamps:
    """How rooms are lit. red, blue: factors of the tint, from and to; shares of the lights that change or flicker."""

    presets: Mapping[LightPreset, float] = field(
        default_factory=lambda: {"office": 0.35, "window_left": 0.18, "window_right": 0.18, "warm": 0.17, "hard": 0.12}
    )
    red: tuple[float, float] = (0.92, 1.08)
    blue: tuple[float, float] = (0.88, 1.08)
    change_share: float = 0.3
    flicker_share: float = 0.1


ANY_LAMPS = Lamps()


def draw_light(dice: Dice, duration_s: float, *, empty: bool, lamps: Lamps = ANY_LAMPS) -> Light:
    """A light; in an empty room it always changes or flickers, for there nothing else happens."""
    preset = dice.weighed(lamps.presets)
    tint = (dice.between(*lamps.red), 1.0, dice.between(*lamps.blue))
    flickers = dice.chance(0.6 if empty else lamps.flicker_share)
    depth, rate_hz = dice.between(0.05, 0.4 if empty else 0.2), dice.between_log(0.7, 12, 2)
    changes = dice.chance(lamps.change_share) or (empty and not flickers)
    return Light(
        preset=preset,
        tint=tint,
        changes=_draw_changes(dice, duration_s) if changes else [],
        flicker_depth=depth if flickers else 0.0,
        flicker_hz=rate_hz,
        auto_exposure=dice.chance(0.8),
    )


def _draw_changes(dice: Dice, duration_s: float) -> list[LightChange]:
    times = sorted(dice.between(0.3, duration_s - 0.3, 2) for _ in range(dice.whole(1, 2)))
    return [
        LightChange(at_s=at_s, gain=dice.between_log(0.45, 1.6), over_s=dice.weighed({0.0: 0.3, 0.1: 0.4, 1.0: 0.3}))
        for at_s in times
    ]
