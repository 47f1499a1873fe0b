"""Fits which posture a hand is in (`deixis_gesture/posture.onnx`), on outlines of hands of any shape, seen from anywhere.

usage: python fitting/fit_posture.py [--hands N] [--rounds N] [--out FILE]

The hands (`deixis_simulation.lone_hands`) are those of the fitting people, cut out as badly as a tracker does; held-out
people's say how sure a posture must be (SURE). Twice as many rounds with a network twice as large told these better (.64 for
.78 nats) and real hands worse: eight people have few hands, and the held-out ones' are of the same make. Needs PyTorch and
ONNX, which Deixis itself does not: `pip install torch onnx`. A core draws 100 hands a second.
"""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from deixis_gesture.hand import CHEST, Face, HandShape, hand_of
from deixis_gesture.hand_posture import NAMED, raster_of
from deixis_simulation.avatars import FITTING_AVATARS, HELD_OUT_AVATARS
from deixis_simulation.lone_hands import PX_PER_FACE, LoneHand, lone_hands
from hand_outlines import coarse
from numpy.typing import NDArray
from parent_watch import end_with_parent

OUT = Path(__file__).resolve().parents[1] / "services/gesture/deixis_gesture/posture.onnx"
PART, TIMES = 1000, 4
"""Hands that a process draws at once; how often each is cut out, each time worse in another way."""
FACE_PX = (16, 80)
"""Width of the face in the picture: how coarse the hand is."""
ARM_MISSED_DEG, REACH = 22.0, (0.8, 4.2)
"""How far off the way of the forearm the way from the chest is; how far from the chest hands are, face widths."""
HELD_OUT_SEED = 1_000_000
SURE_TRIED = (0.5, 0.6, 0.7, 0.8, 0.9)
Floats = NDArray[np.floating[Any]]


def main() -> int:
    """Draw, fit, say how good it is, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hands", type=int, default=40000, help="of fitting people (default: 40000)")
    parser.add_argument("--rounds", type=int, default=8, help="times that all are seen (default: 8)")
    parser.add_argument("--out", type=Path, default=OUT, help="file of weights to write")
    given = parser.parse_args()
    try:
        from posture_network import PostureFit  # noqa: PLC0415 (PyTorch is not installed with Deixis)
    except ModuleNotFoundError as error:
        print(f"fit_posture: {error}; pip install torch onnx", file=sys.stderr)
        return 2
    fitting, shapes = drawn(range(1, 1 + -(-given.hands // PART)))
    checking, known = drawn(range(HELD_OUT_SEED, HELD_OUT_SEED + 6))
    fit = PostureFit(given.rounds, len(fitting))
    for number in range(given.rounds):
        loss = fit.round(fitting, shapes)
        print(f"round {number + 1}: loss {loss:.3f}, of held-out people {fit.loss(checking, known):.3f}", flush=True)
    fit.export(given.out)
    say(fit.shares(checking), known)
    return 0


def drawn(seeds: range) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Rasters (n, side, side) of 0 to 255 and which of NAMED each is (n,)."""
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn"), initializer=end_with_parent) as pool:
        parts = list(pool.map(_drawn, seeds))
    return np.concatenate([rasters for rasters, _ in parts]), np.concatenate([shapes for _, shapes in parts])


def _drawn(seed: int) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    cv2.setNumThreads(1)
    rng = np.random.default_rng(seed)
    rasters, shapes = [], []
    for known in lone_hands(seed, HELD_OUT_AVATARS if seed >= HELD_OUT_SEED else FITTING_AVATARS, PART):
        for _ in range(TIMES):
            hand = seen_alone(known, rng)
            if hand is not None:
                rasters.append(np.round(255 * raster_of(hand)).astype(np.uint8))
                shapes.append(NAMED.index(known.shape))
    return np.array(rasters), np.array(shapes)


def seen_alone(known: LoneHand, rng: np.random.Generator) -> HandShape | None:
    """The hand as the stage has it, at the end of an arm that goes about its way; none where nothing is left of it."""
    face_px = float(np.exp(rng.uniform(*np.log(FACE_PX))))
    share = face_px / PX_PER_FACE
    padded = np.pad(known.mask, 8)
    small = cv2.resize(padded * np.uint8(255), None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
    mask = coarse(np.asarray(small > 127, np.uint8), face_px, rng)
    if rng.random() < 0.5:
        mask = np.ascontiguousarray(mask[:, ::-1])
        along = known.along * (-1, 1)
    else:
        along = known.along
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not outlines:
        return None
    outline = max(outlines, key=len)[:, 0, :]
    missed = np.radians(rng.normal(0, ARM_MISSED_DEG))
    way = np.array([[np.cos(missed), -np.sin(missed)], [np.sin(missed), np.cos(missed)]]) @ along
    place = outline.mean(axis=0) - face_px * (np.array(CHEST) + rng.uniform(*REACH) * way)
    return hand_of(Face(float(place[0]), float(place[1]), face_px).normalised(outline))


def say(shares: Floats, known: NDArray[np.int64]) -> None:
    """Recall and precision of each posture by how sure it must be, each as frequent as it was drawn."""
    best = shares.argmax(axis=1)
    for sure in SURE_TRIED:
        told = np.where(shares.max(axis=1) >= sure, best, -1)
        figures = [f"{(told == -1).mean():.0%} unknown"]
        for number, name in enumerate(NAMED):
            own, said = known == number, told == number
            figures.append(f"{name} {(own & said).sum() / own.sum():.2f} / {(own & said).sum() / max(1, said.sum()):.2f}")
        print(f"sure from {sure}: " + ", ".join(figures) + " (recall / precision)")


if __name__ == "__main__":
    raise SystemExit(main())
