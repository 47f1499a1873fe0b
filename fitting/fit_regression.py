"""Fits the regression of head pose (`deixis_headpose/regression.npz`) on portraits that the simulator renders.

usage: python fitting/fit_regression.py [--portraits N] [--minutes M] [--rate R] [--cache DIR] [--from FILE] [--out FILE]

Portraits are of the simulator's fitting people alone (seeds below 1000); at the end the errors on the people who were held
out are printed, which choose nothing here. Needs PyTorch, which Deixis itself does not: `pip install torch`. Two cores render
70 portraits a second and read 900 crops a second while training. What is committed came from several such runs, one after the
other (services/headpose/README.md). Another run gives other weights, as good.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from queue import Empty
from typing import Any

import cv2
import numpy as np
from fit_crops import Crops, Portraits, crops_of
from numpy.typing import NDArray
from parent_watch import end_with_parent

ROOT = Path(__file__).resolve().parents[1]
WEIGHTS = ROOT / "services/headpose/deixis_headpose/regression.npz"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "deixis" / "portraits"
PART = 2000
"""Portraits of one file, made by one process."""
FITTING_SEEDS, HELD_OUT_SEED = range(1, 1000), 1001
BATCH = 64
BANDS = ((0, 15), (15, 30), (30, 60), (60, 90), (90, 130), (130, 181))


def main() -> int:
    """Render what is not there, fit, and say how good it is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--portraits", type=int, default=20000, help="of fitting people (default: 20000)")
    parser.add_argument("--minutes", type=float, default=60.0, help="of training (default: 60)")
    parser.add_argument("--rate", type=float, default=1.5e-3, help="learning rate to begin with (default: .0015)")
    parser.add_argument(
        "--cache",
        type=Path,
        default=CACHE,
        help="folder of rendered portraits and checkpoints; remove it after a change of portraits",
    )
    parser.add_argument("--from", type=Path, dest="start", help="checkpoint (.pt) or weights (.npz) to go on from")
    parser.add_argument("--out", type=Path, default=WEIGHTS, help="file of weights to write")
    given = parser.parse_args()
    try:
        from fit_network import Fit  # noqa: PLC0415 (PyTorch is not installed with Deixis)
    except ModuleNotFoundError as error:
        print(f"fit_regression: {error}; pip install torch", file=sys.stderr)
        return 2
    given.cache.mkdir(parents=True, exist_ok=True)
    count = -(-given.portraits // PART)
    fitting = render(given.cache, list(FITTING_SEEDS)[:count], PART)
    held_out = render(given.cache, [HELD_OUT_SEED], PART)
    with CropMaker(fitting) as maker:
        fit = Fit(given.start, np.concatenate([maker.take().pixels for _ in range(8)]), given.rate)
        train(fit, maker, given.minutes, given.cache / "checkpoint.pt")
    fit.export(given.out)
    print_errors(fit, Portraits.load(held_out))
    return 0


def train(fit: Any, maker: CropMaker, minutes: float, checkpoint: Path) -> None:
    """Fit for so long, the learning rate falling to nothing (a half cosine)."""
    start, losses = time.monotonic(), []
    while (share := (time.monotonic() - start) / 60 / minutes) < 1:
        losses.append(fit.step(maker.take(), share))
        if len(losses) % 200 == 0:
            print(f"{len(losses)} steps, {share * minutes:.1f} min: loss {np.mean(losses[-200:]):.3f}", flush=True)
            fit.save(checkpoint)


def render(cache: Path, seeds: list[int], count: int) -> list[Path]:
    """Files of portraits, one a seed; those that are there already are kept."""
    paths = [cache / f"portraits_{seed}_{count}.npz" for seed in seeds]
    missing = [(path, seed, count) for path, seed in zip(paths, seeds, strict=True) if not path.exists()]
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn"), initializer=end_with_parent) as pool:
        for path in pool.map(_render, missing):
            print(f"{path.name} is rendered", flush=True)
    return paths


def _render(job: tuple[Path, int, int]) -> Path:
    os.environ["LP_NUM_THREADS"] = "0"  # Mesa's: one process a core is quicker than all cores on one picture
    from deixis_simulation.draw import avatars_of  # noqa: PLC0415 (after Mesa was told)
    from deixis_simulation.portraits import portraits  # noqa: PLC0415

    path, seed, count = job
    Portraits.of(list(portraits(seed, avatars_of(seed), count))).save(path)
    return path


class CropMaker:
    """Crops for training, made by a process of their own while the network learns."""

    def __init__(self, paths: list[Path]) -> None:
        context = get_context("spawn")
        self._queue: Any = context.Queue(6)
        self._process = context.Process(target=_make, args=(paths, self._queue), daemon=True)

    def __enter__(self) -> CropMaker:
        self._process.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()

    def take(self) -> Crops:
        """The next batch. Raises RuntimeError where the process has died: waiting for it would never end."""
        while True:
            try:
                made: Crops = self._queue.get(timeout=20)
                return made
            except Empty:
                if not self._process.is_alive():
                    raise RuntimeError("the process that makes crops has died") from None


def _make(paths: list[Path], queue: Any) -> None:
    end_with_parent()
    cv2.setNumThreads(1)
    rng, portraits = np.random.default_rng(), Portraits.load(paths)
    while True:
        queue.put(crops_of(portraits, rng.integers(0, len(portraits), BATCH), rng))


def print_errors(fit: Any, portraits: Portraits) -> None:
    """Yaw errors of one look each at held-out people, by how far the head is turned, degrees."""
    rng = np.random.default_rng(0)
    crops = crops_of(portraits, np.arange(len(portraits)), rng)
    crops = crops.only(crops.head)
    read, true = (yaws_of(nose) for nose in (fit.noses(crops.pixels), -crops.rotations[:, :, 2]))
    error = np.abs((read - true + 180) % 360 - 180)
    for low, high in BANDS:
        at = (np.abs(true) >= low) & (np.abs(true) < high)
        print(f"{low:3d}-{high:<3d}: {at.sum():4d} looks, mean {error[at].mean():5.1f}, median {np.median(error[at]):5.1f}")


def yaws_of(noses: NDArray[Any]) -> NDArray[Any]:
    """Yaw, degrees, of directions (n, 3) of the nose."""
    return np.asarray(np.degrees(np.arctan2(noses[:, 0], -noses[:, 2])))


if __name__ == "__main__":
    raise SystemExit(main())
