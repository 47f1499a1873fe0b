"""Chooses how exactly arms are seen, and how often not at all: constants of `deixis_gesture/bearing.py` (`TRIED`).

usage: python fitting/choose_bearing.py [--seeds A:B] [--kind KIND] [--plain]

Tracker and gesture stage play the clips of these seeds (default: those of 0:20 with one person who points); for each value of
each constant, the others as they stand, it is said how likely it makes the true bearings of the pointings that are recognised
(blurred as fusion does), and how far off the likeliest bearings are. It plays the clips once: some minutes on two cores, and
half a minute to render each where it is not there.
"""

from __future__ import annotations

import argparse

import numpy as np
from deixis_evaluation.angle_scores import signed_error_deg
from deixis_evaluation.chosen_clips import Choice, choose
from deixis_evaluation.clips import Clip
from deixis_evaluation.episode_scores import strokes_of
from deixis_evaluation.gesture_play import GestureSetup, play_gestures
from deixis_fusion.config import HandConfig
from deixis_gesture import bearing, person
from deixis_gesture.bearing import BEARINGS, ArmSight, Bearing, Floats, estimate_bearing
from deixis_schemas.messages import Side
from rich.console import Console

TRIED = {
    "OUTLIERS": (0.03, 0.1, 0.3, 0.5, 0.8),
    "TIP_SIGMA": (0.1, 0.15, 0.22, 0.3),
    "FAR_TIP_SIGMA": (0.02, 0.03, 0.05, 0.08),
    "EXTENT_SIGMA": (0.07, 0.1, 0.15, 0.22),
    "DIRECTION_SIGMA": (0.2, 0.35, 0.6),
}
LEAST_FRAMES = 5
BLUR_DEG, NONSENSE = HandConfig().sigma_floor_deg, HandConfig().outlier
"""As fusion reads bearings."""
Asked = tuple[ArmSight, Side | None]


def main() -> int:
    """Play, try, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0:20")
    parser.add_argument("--kind", default="point", help="of the simulator's clips (default: point)")
    parser.add_argument("--plain", action="store_true", help="plain clips of these seeds, without difficulties")
    given = parser.parse_args()
    clips = choose(Choice(None, given.seeds, kinds=(given.kind,), plain=given.plain), Console(stderr=True)).clips
    strokes = [stroke for clip in clips for stroke in asked_in(clip)]
    for name, values in TRIED.items():
        stands = getattr(bearing, name)
        for value in values:
            setattr(bearing, name, value)
            told, off = zip(*(_read(true_deg, asked) for true_deg, asked in strokes), strict=True)
            print(f"{name} {value:g}: {-np.mean(told):.3f} nats, {np.median(off):.0f} degrees off (median)")
        setattr(bearing, name, stands)
    print(f"{len(strokes)} strokes")
    return 0


def asked_in(clip: Clip) -> list[tuple[float, list[Asked]]]:
    """Of each stroke that is recognised: the true bearing, and what the bearing was asked of, frame by frame."""
    asked: list[Asked] = []

    def listen(seen: ArmSight, side: Side | None) -> Bearing:
        asked.append((seen, side))
        return estimate_bearing(seen, side)

    of_frame: dict[int, list[Asked]] = {}

    def keep() -> None:
        of_frame[len(of_frame)] = list(asked)
        asked.clear()

    person.estimate_bearing = listen  # type: ignore[attr-defined]  # the core's own call, overheard
    try:
        play_gestures(clip, GestureSetup(), keep)
    finally:
        person.estimate_bearing = estimate_bearing  # type: ignore[attr-defined]
    found = []
    for stroke in strokes_of(clip.truth):
        own = [one for frame in range(stroke.first, stroke.last + 1) for one in of_frame.get(frame, [])]
        if len(own) >= LEAST_FRAMES:
            found.append((stroke.azimuth_deg, own))
    return found


def _read(true_deg: float, asked: list[Asked]) -> tuple[float, float]:
    """Log of the true bearing's probability, and how far off the likeliest one is."""
    curve = np.mean([estimate_bearing(*one).likelihood for one in asked], axis=0)
    shares = (1 - NONSENSE) * _blurred(curve / curve.sum()) + NONSENSE / len(BEARINGS)
    off = np.array([abs(signed_error_deg(float(deg), true_deg)) for deg in BEARINGS])
    return float(np.log(shares[int(off.argmin())])), float(off[int(curve.argmax())])


def _blurred(shares: Floats) -> Floats:
    off = (BEARINGS[:, None] - BEARINGS + 180) % 360 - 180
    weights = np.exp(-0.5 * (off / BLUR_DEG) ** 2)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True) @ shares)


if __name__ == "__main__":
    raise SystemExit(main())
