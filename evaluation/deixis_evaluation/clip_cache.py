"""Clips of the simulator by seed: made where they are missing, and kept for the next time.

The simulator is optional, so it is not imported: its command is run, one process a seed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from .clips import Clip, ClipError, load_truth

SIMULATOR = "deixis-simulation"
MADE_WITHIN_S = 1800.0
"""Longest time that one clip may take to be rendered."""
SAID = 600


@dataclass(frozen=True)
class ClipCache:
    """A folder of clips made by one version of the simulator; of these `kinds` only, or of all where there are none.

    A seed gives another clip when the kinds differ, so each choice of them has a folder of its own.
    """

    root: Path
    version: str
    kinds: tuple[str, ...] = ()

    @property
    def folder(self) -> Path:
        """Where the clips lie."""
        return self.root / self.version / ("-".join(self.kinds) or "all")

    def find(self, seed: int) -> Path | None:
        """The video of clip 0 of a seed, where it is there with its labels; both get their names when they are complete."""
        found = [path for path in sorted(self.folder.glob(f"s{seed:04d}_000_*.mp4")) if path.with_suffix(".json").exists()]
        return found[0] if found else None

    def load(self, seeds: Sequence[int]) -> list[Clip]:
        """The clips of these seeds. Raises ClipError where one is missing or bad."""
        videos = {seed: self.find(seed) for seed in seeds}
        missing = [str(seed) for seed, video in videos.items() if video is None]
        if missing:
            raise ClipError(f"'{self.folder}' holds no clip of seed {', '.join(missing[:5])}")
        return [Clip(video.stem, video, load_truth(video.with_suffix(".json"))) for video in videos.values() if video]


def default_root() -> Path:
    """Where clips are kept unless it is said otherwise."""
    cache = os.environ.get("XDG_CACHE_HOME")
    return (Path(cache) if cache else Path.home() / ".cache") / "deixis" / "clips"


def simulator_version() -> str:
    """Version of the simulator that is installed here. Raises ClipError where none is."""
    try:
        return version(SIMULATOR)
    except PackageNotFoundError:
        hint = f"pip install {SIMULATOR} (in a checkout: pip install ./simulation)"
        raise ClipError(f"{SIMULATOR} is not installed: {hint}") from None


def make_missing(cache: ClipCache, seeds: Sequence[int], jobs: int, on_made: Callable[[int], None] | None = None) -> None:
    """Have the simulator make the clips that are not in the cache; `on_made` is called with each seed done.

    Raises ClipError with the simulator's own words where one fails; those made before stay.
    """
    missing = [seed for seed in seeds if cache.find(seed) is None]
    try:
        cache.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ClipError(f"clips cannot be kept in '{cache.folder}': {error.strerror}") from None
    workers = ThreadPoolExecutor(max(1, jobs))
    try:
        made = {workers.submit(_make, cache, seed): seed for seed in missing}
        for future in as_completed(made):
            future.result()
            if on_made is not None:
                on_made(made[future])
    finally:
        workers.shutdown(cancel_futures=True)


def _make(cache: ClipCache, seed: int) -> None:
    command = [str(Path(sys.executable).parent / "deixis"), "simulate", "--out", str(cache.folder), "--count", "1"]
    # With label pictures: `--truth tracker` and the comparison with real hands read them, and they cost little.
    command += ["--labels", "--seed", str(seed), *(["--kinds", ",".join(cache.kinds)] if cache.kinds else [])]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=MADE_WITHIN_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ClipError(f"the clip of seed {seed} was not made: {error}") from None
    if done.returncode or cache.find(seed) is None:
        said = done.stderr.strip()[-SAID:] or f"exit status {done.returncode}, and no s{seed:04d}_000_*.mp4"
        raise ClipError(f"the clip of seed {seed} was not made: {said}")
