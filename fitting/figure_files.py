"""Figures of the simulator (`deixis_simulation/figures.py`) in files, so that they are rendered once."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from deixis_simulation.figures import Figure, Truth
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "deixis" / "figures"
PART = 500
"""Figures of one file, made by one process."""
ROOMS = 25
"""Empty rooms of one file: what stands in them must not be taken for heads and hands."""
MOST_PEOPLE = 2
HEAD, BREADTH, HEAD_PX, SEEN, HANDS, AREAS = slice(0, 2), 2, 3, 4, slice(5, 9), slice(9, 11)
"""Columns of what is known of a person; hands: x and y of the right one, then of the left one."""


@dataclass(frozen=True)
class Figures:
    """Many. pictures: (n, h, w, 3) BGR; people: (n, MOST_PEOPLE, 11), of columns as above, not a number where there is none;
    rooms: (m, h, w, 3) without people.
    """

    pictures: NDArray[np.uint8]
    people: Floats
    rooms: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.pictures)

    @classmethod
    def of(cls, figures: Sequence[Figure], rooms: Sequence[NDArray[np.uint8]]) -> Figures:
        """From the simulator's."""
        people = np.full((len(figures), MOST_PEOPLE, 11), np.nan, np.float32)
        for row, figure in enumerate(figures):
            for number, truth in enumerate(figure.people):
                people[row, number] = _columns(truth)
        return cls(np.array([figure.picture for figure in figures]), people, np.array(rooms))

    def save(self, path: Path) -> None:
        """Write a file, whole or not at all."""
        part = path.with_suffix(".part")
        with part.open("wb") as file:
            np.savez(file, **vars(self))
        part.replace(path)

    @classmethod
    def load(cls, paths: Sequence[Path]) -> Figures:
        """All figures of some files."""
        files = [np.load(path) for path in paths]
        return cls(*(np.concatenate([file[name] for file in files]) for name in ("pictures", "people", "rooms")))


def _columns(truth: Truth) -> Floats:
    return np.array(
        [*truth.centre_px, truth.breadth_px, truth.head_px, truth.seen, *truth.hands_px.ravel(), *truth.hand_areas_px]
    )


def render(cache: Path, seeds: Sequence[int], count: int = PART) -> list[Path]:
    """Files of figures, one a seed; those that are there already are kept."""
    cache.mkdir(parents=True, exist_ok=True)
    paths = [cache / f"figures_{seed}_{count}.npz" for seed in seeds]
    missing = [(path, seed, count) for path, seed in zip(paths, seeds, strict=True) if not path.exists()]
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        for path in pool.map(_render, missing):
            print(f"{path.name} is rendered", flush=True)
    return paths


def _render(job: tuple[Path, int, int]) -> Path:
    os.environ["LP_NUM_THREADS"] = "0"  # Mesa's: one process a core is quicker than all cores on one picture
    from deixis_simulation.draw import avatars_of  # noqa: PLC0415 (after Mesa was told)
    from deixis_simulation.figures import figures  # noqa: PLC0415
    from deixis_simulation.studio import room_pictures  # noqa: PLC0415

    path, seed, count = job
    rooms = room_pictures(np.random.default_rng((seed, 1)), ROOMS)
    Figures.of(list(figures(seed, avatars_of(seed), count)), rooms).save(path)
    return path
