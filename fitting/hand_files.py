"""Held hands of the simulator (`deixis_simulation/held_hands.py`) in files, so that they are rendered once."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "deixis" / "hands"
SCENES = 20
"""Scenes of one file, made by one process."""
QUIET_FROM = 30
"""Of each hundred seeds, from which on nobody points: of the fourteen other gestures there are few of each elsewhere."""


@dataclass(frozen=True)
class KnownHand:
    """One hand: what its person does, whose left or right it is, its pixels (h, w) and those of the other hand, both from the
    same corner; head_px: middle of the head, about that corner.
    """

    gesture: str
    side: str
    hand: Mask
    other: Mask
    head_px: tuple[float, float]
    face_width_px: float


def load_hands(seeds: Sequence[int], cache: Path = CACHE, jobs: int | None = None) -> list[KnownHand]:
    """All hands of these seeds; those that are in no file yet are rendered."""
    cache.mkdir(parents=True, exist_ok=True)
    paths = [cache / f"hands_{seed}_{SCENES}.npz" for seed in seeds]
    missing = [(path, seed) for path, seed in zip(paths, seeds, strict=True) if not path.exists()]
    with ProcessPoolExecutor(jobs or os.cpu_count(), mp_context=get_context("spawn")) as pool:
        for path in pool.map(_render, missing):
            print(f"{path.name} is rendered", flush=True)
    return [hand for path in paths for hand in _load(path)]


def _load(path: Path) -> list[KnownHand]:
    stored: dict[str, Any] = dict(np.load(path))
    hands, at = [], 0
    pixels = np.unpackbits(stored["pixels"]).astype(bool)
    for row, (height, width) in enumerate(stored["shapes"]):
        both = pixels[at : at + 2 * height * width].reshape(2, height, width)
        at += 2 * height * width
        gesture, side = stored["gestures"][row], stored["sides"][row]
        x, y = stored["heads_px"][row]
        hands.append(
            KnownHand(str(gesture), str(side), both[0], both[1], (float(x), float(y)), float(stored["widths_px"][row]))
        )
    return hands


def _render(job: tuple[Path, int]) -> Path:
    os.environ["LP_NUM_THREADS"] = "0"  # Mesa's: one process a core is quicker than all cores on one picture
    from deixis_simulation.held_hands import held_hands  # noqa: PLC0415 (after Mesa was told)
    from deixis_simulation.scene import KINDS  # noqa: PLC0415

    path, seed = job
    rows, pixels = [], []
    for held in held_hands(seed, range(SCENES), ("quiet",) if seed % 100 >= QUIET_FROM else KINDS):
        (top, left), (bottom, right) = _corners(held.hand | held.other)
        both = np.stack([held.hand, held.other])[:, top:bottom, left:right]
        head = held.head_px - np.array(held.corner_px) - (left, top)
        rows.append((held.gesture, held.side, both.shape[1:], head, held.face_width_px))
        pixels.append(both.ravel())
    gestures, sides, shapes, heads, widths = zip(*rows, strict=True)
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez_compressed(
            file,
            pixels=np.packbits(np.concatenate(pixels)),
            gestures=np.array(gestures),
            sides=np.array(sides),
            shapes=np.array(shapes),
            heads_px=np.array(heads),
            widths_px=np.array(widths),
        )
    part.replace(path)
    return path


def _corners(mask: Mask) -> tuple[tuple[int, int], tuple[int, int]]:
    rows, columns = np.nonzero(mask)
    return (int(rows.min()), int(columns.min())), (int(rows.max()) + 1, int(columns.max()) + 1)
