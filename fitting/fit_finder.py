"""Fits the finder of heads and hands (`deixis_tracker/finder.onnx`) on figures that the simulator renders.

usage: python fitting/fit_finder.py [--figures N] [--minutes M] [--cache DIR] [--from FILE] [--out FILE]

Figures are of the simulator's fitting people alone (seeds below 1000); at the end it is said what is found of the people who
were held out, which chooses nothing here. Needs PyTorch and ONNX, which Deixis itself does not: `pip install torch onnx`.
"""

from __future__ import annotations

import argparse
import sys
import time
from multiprocessing import get_context
from pathlib import Path
from queue import Empty
from typing import Any

import cv2
import numpy as np
from figure_files import CACHE, PART, Figures, render
from fit_windows import Windows, windows_of
from numpy.typing import NDArray
from parent_watch import end_with_parent

ROOT = Path(__file__).resolve().parents[1]
WEIGHTS = ROOT / "services/tracker/deixis_tracker/finder.onnx"
FITTING_SEEDS, HELD_OUT_SEED = range(1, 1000), 1001
BATCH, MAKERS, HELD_OUT_WINDOWS = 32, 2, 400
THINGS = ("head", "right hand", "left hand")
SURE = 0.8
"""Cells of a map from here on are the middle of a thing."""


def main() -> int:
    """Render what is not there, fit, and say how good it is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figures", type=int, default=15000, help="of fitting people (default: 15000)")
    parser.add_argument("--minutes", type=float, default=60.0, help="of training (default: 60)")
    parser.add_argument("--cache", type=Path, default=CACHE, help="folder of rendered figures and checkpoints")
    parser.add_argument("--from", type=Path, dest="start", help="checkpoint (.pt) or weights (.onnx) to go on from")
    parser.add_argument("--out", type=Path, default=WEIGHTS, help="file to write")
    given = parser.parse_args()
    try:
        from finder_network import Fit  # noqa: PLC0415 (PyTorch is not installed with Deixis)
    except ModuleNotFoundError as error:
        print(f"fit_finder: {error}; pip install torch onnx", file=sys.stderr)
        return 2
    fitting = render(given.cache, list(FITTING_SEEDS)[: -(-given.figures // PART)])
    held_out = render(given.cache, [HELD_OUT_SEED])
    fit = Fit(given.start)
    with WindowMaker(fitting) as maker:
        if given.start is not None and given.start.suffix == ".onnx":
            fit.settle(maker.take())
        train(fit, maker, given.minutes, given.cache / "checkpoint.pt")
    fit.export(given.out)
    print_found(fit, Figures.load(held_out))
    return 0


def train(fit: Any, maker: WindowMaker, minutes: float, checkpoint: Path) -> None:
    """Fit for so long, the learning rate falling to nothing (a half cosine)."""
    start, losses = time.monotonic(), []
    while (share := (time.monotonic() - start) / 60 / minutes) < 1:
        losses.append(fit.step(maker.take(), share))
        if len(losses) % 200 == 0:
            print(f"{len(losses)} steps, {share * minutes:.1f} min: loss {np.mean(losses[-200:]):.3f}", flush=True)
            fit.save(checkpoint)


class WindowMaker:
    """Windows for training, made by processes of their own while the network learns."""

    def __init__(self, paths: list[Path]) -> None:
        context = get_context("spawn")
        self._queue: Any = context.Queue(6)
        shares = [paths[number::MAKERS] for number in range(min(MAKERS, len(paths)))]
        self._processes = [context.Process(target=_make, args=(share, self._queue), daemon=True) for share in shares]

    def __enter__(self) -> WindowMaker:
        for process in self._processes:
            process.start()
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.terminate()

    def take(self) -> Windows:
        """The next batch. Raises RuntimeError where a process has died: waiting for it would never end."""
        while True:
            try:
                made: Windows = self._queue.get(timeout=20)
                return made
            except Empty:
                if not all(process.is_alive() for process in self._processes):
                    raise RuntimeError("a process that makes windows has died") from None


def _make(paths: list[Path], queue: Any) -> None:
    end_with_parent()
    cv2.setNumThreads(1)
    rng, figures = np.random.default_rng(), Figures.load(paths)
    while True:
        queue.put(windows_of(figures, BATCH, rng))


def print_found(fit: Any, figures: Figures) -> None:
    """What is found of held-out people in single windows, and what is made up."""
    windows = windows_of(figures, HELD_OUT_WINDOWS, np.random.default_rng(0))
    answers = fit.maps(windows.pixels)
    for number, thing in enumerate(THINGS):
        maps, odds = windows.maps[:, number], answers[:, number]
        empty = (maps < 0.01) & (windows.weights[:, number] > 0)
        found, false = float((_best_near(odds)[maps > SURE] > 0).mean()), int((odds[empty] > 0).sum())
        print(f"{thing}: {found:.1%} of middles found, {false} cells of {empty.sum()} empty ones taken for it")


def _best_near(maps: NDArray[Any]) -> NDArray[Any]:
    """Each cell's best neighbour."""
    return np.array([cv2.dilate(one, np.ones((3, 3), np.uint8)) for one in maps])


if __name__ == "__main__":
    raise SystemExit(main())
