"""Makes the arms by which the gesture stage reads the direction of a pointing (`deixis_gesture/arms.npz`).

usage: python fitting/fit_arms.py [--arms N] [--out FILE] [--check]

The simulator lets N people of its fitting avatars point all around (`deixis_simulation.pointing_arms`): where their fingertips
are is what the stage compares a fingertip with. No picture is rendered. It takes about ten minutes on two cores. With --check
nothing is written: a thousand arms of the people who were held out are read by the file that is there, with tips and distances
that are measured badly, and it is said how far off and how sure bearings and elevations are: `bearing.py` has NO_ARM by that.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from deixis_gesture.bearing import (
    BEARINGS,
    EXTENT_SIGMA,
    PALM_RADII,
    PALM_SIGMA,
    SHAPE_BEARINGS,
    ArmSight,
    Bearing,
    Ray,
    estimate_bearing,
)

OUT = Path(__file__).resolve().parents[1] / "services/gesture/deixis_gesture/arms.npz"
PART = 250
"""Arms of one seed; seeds below 1000 are for fitting."""
CHECKED_SEEDS = range(1001, 1005)
MISSED, DISTANCE_MISSED, DISTANCES = 0.2, 0.09, (6.7, 21.3)
"""How far off tips (face widths) and distances (share) are measured; how far away people stand, face widths."""


def main() -> int:
    """Draw, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", type=int, default=6000, help="how many (default: 6000)")
    parser.add_argument("--out", type=Path, default=OUT, help="file to write")
    parser.add_argument("--check", action="store_true", help="read arms of held-out people, and write nothing")
    given = parser.parse_args()
    if given.check:
        check(drawn([(seed, False) for seed in CHECKED_SEEDS]))
        return 0
    arms = drawn([(seed, True) for seed in range(1, 1 + -(-given.arms // PART))])
    names = ("bearings_deg", "elevations_deg", "tips", "fists")
    bearings, elevations, tips, fists = (arms[name].astype(np.float16) for name in names)
    np.savez_compressed(given.out, bearings_deg=bearings, elevations_deg=elevations, left=arms["left"], tips=tips, fists=fists)
    return 0


def drawn(parts: list[tuple[int, bool]]) -> dict[str, np.ndarray]:
    """Of these seeds' arms: bearings_deg and elevations_deg (n,), left (n,), whether it is that arm, tips and fists (n, 3)."""
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        made = list(pool.map(_part, parts))
    return {name: np.concatenate([part[name] for part in made]) for name in made[0]}


def check(arms: dict[str, np.ndarray]) -> None:
    """Say how well these arms are read."""
    rng, errors, inside, high = np.random.default_rng(0), [], [], []
    for bearing, is_left, tip, fist, elevation in zip(
        *(arms[name] for name in ("bearings_deg", "left", "tips", "fists", "elevations_deg")), strict=True
    ):
        missed = rng.normal(0, MISSED, 3) * (1, 1, 0)
        answer = _read(bearing, is_left, (tip + missed, fist + missed), rng)
        if answer.elevation_deg is not None and answer.elevation_sigma_deg is not None:
            high.append((answer.elevation_deg - elevation, answer.elevation_sigma_deg, elevation))
        told = np.array(answer.likelihood)
        order = np.argsort(-told)
        place = int(np.nonzero(order == int(np.argmin(np.abs(_wrapped(BEARINGS - bearing)))))[0][0])
        inside.append(float(told[order][:place].sum() / told.sum()))
        errors.append(abs(_wrapped(BEARINGS[order[0]] - bearing)))
    print(f"{len(errors)} arms: the likeliest bearing is off by {np.median(errors):.1f} deg (median); the likeliest", end=" ")
    print(", ".join(f"{level:.0%} hold {np.mean(np.array(inside) < level):.0%}" for level in (0.68, 0.95)))
    off, sigmas, true = np.array(high).T
    within = [np.mean(np.abs(off) < width * sigmas) for width in (1.0, 1.96)]
    apart = np.median(np.abs(true - np.median(true)))
    print(f"elevation: off by {np.median(np.abs(off)):.1f} deg (median; true ones are {apart:.1f} from theirs);", end=" ")
    print(f"within 1 and 1.96 sigma {within[0]:.0%}, {within[1]:.0%}; mean sigma {sigmas.mean():.1f} deg")


def _read(bearing: float, is_left: bool, places: tuple[np.ndarray, np.ndarray], rng: np.random.Generator) -> Bearing:
    """What the stage makes of an arm whose person's distance is measured as badly as its hand."""
    distance, height = rng.uniform(*DISTANCES), rng.uniform(-1, 4)
    measured = distance * np.exp(rng.normal(0, DISTANCE_MISSED))
    tip, fist = (_ray(place, distance, height) for place in places)
    finger = rng.normal(0, EXTENT_SIGMA / measured, 2)
    fist = Ray(fist.aside + finger[0], fist.slope + finger[1])
    radius = np.interp(abs(bearing), SHAPE_BEARINGS, PALM_RADII) + rng.normal(0, PALM_SIGMA)
    seen = ArmSight(tip, fist, radius, measured, height * measured / distance)
    return estimate_bearing(seen, "left" if is_left else "right")


def _ray(place: np.ndarray, distance: float, height: float) -> Ray:
    right, up, toward = place
    ahead = distance - toward
    return Ray(right / ahead, (height + up) / np.hypot(ahead, right))


def _wrapped(degrees: np.ndarray) -> np.ndarray:
    return (degrees + 180) % 360 - 180


def _part(job: tuple[int, bool]) -> dict[str, np.ndarray]:
    from deixis_simulation.avatars import FITTING_AVATARS, HELD_OUT_AVATARS  # noqa: PLC0415 (in the process that draws)
    from deixis_simulation.pointing_arms import pointing_arms  # noqa: PLC0415

    seed, fitting = job
    arms = list(pointing_arms(seed, FITTING_AVATARS if fitting else HELD_OUT_AVATARS, PART))
    print(f"{PART} arms of seed {seed}", flush=True)
    return {
        "bearings_deg": np.array([arm.bearing_deg for arm in arms]),
        "elevations_deg": np.array([arm.elevation_deg for arm in arms]),
        "left": np.array([arm.side == "left" for arm in arms]),
        "tips": np.array([arm.tip for arm in arms]),
        "fists": np.array([arm.fist for arm in arms]),
    }


if __name__ == "__main__":
    raise SystemExit(main())
