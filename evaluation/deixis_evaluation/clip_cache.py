"""Clips of the simulator by seed: made where they are missing, and kept for the next time.

The simulator is optional and no dependency, so it is imported only here, and only when its clips are asked for.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from .clips import Clip, ClipError, load_truth

SIMULATOR = "deixis-simulation"
PACKAGE = "deixis_simulation"
SAID = 3
"""So many failed clips are told of."""


@dataclass(frozen=True)
class Simulator:
    """What we use of deixis-simulation: its kinds of clips, and how scenes are drawn and rendered."""

    version: str
    kinds: Sequence[str]
    draw: Any
    jobs: Any
    progress: Any

    def scenes(self, seeds: Sequence[int], kinds: Sequence[str], *, plain: bool = False) -> list[Any]:
        """Scene 0 of each seed, of one of these kinds, of any where there are none; `plain`: without difficulties.

        Raises ClipError for unknown kinds.
        """
        unknown = sorted(set(kinds) - set(self.kinds))
        if unknown:
            raise ClipError(f"--kinds: '{unknown[0]}' is none of {', '.join(self.kinds)}")
        return [self.draw.draw_scene(seed, 0, tuple(kinds) or tuple(self.kinds), plain=plain) for seed in seeds]

    def render(self, scenes: Sequence[Any], folder: Path, jobs: int | None) -> None:
        """Render the scenes whose clips are not in the folder; label pictures too, for `--truth tracker` reads them.

        Raises ClipError where one fails; those rendered before stay. Raises KeyboardInterrupt.
        """
        try:
            with self.progress.shown_progress(scenes) as shown:
                outcome = self.jobs.render_all(scenes, folder, jobs=jobs, labels=True, progress=shown)
        except self.jobs.Interrupted:
            raise KeyboardInterrupt from None
        except OSError as error:
            raise ClipError(f"clips cannot be kept in '{folder}': {error.strerror or error}") from None
        if outcome.failed:
            said = [f"{name}: {why}" for name, why in outcome.failed.items()]
            raise ClipError(f"{len(said)} clips were not rendered: {'; '.join(said[:SAID])}")


@dataclass(frozen=True)
class ClipCache:
    """Folders of clips, one for each version of the simulator, choice of kinds, and whether they are plain: by each of these a
    seed gives another clip.
    """

    root: Path
    simulator: Simulator
    kinds: tuple[str, ...] = ()
    plain: bool = False

    @property
    def folder(self) -> Path:
        """Where the clips lie."""
        kinds = "-".join(self.kinds) or "all"
        return self.root / self.simulator.version / (f"plain-{kinds}" if self.plain else kinds)

    def clips(self, seeds: Sequence[int], jobs: int | None) -> list[Clip]:
        """Clip 0 of each seed. Raises ClipError where one cannot be made or read, KeyboardInterrupt when stopped."""
        scenes = self.simulator.scenes(seeds, self.kinds, plain=self.plain)
        self.simulator.render(scenes, self.folder, jobs)
        videos = [self.folder / f"{scene.name}.mp4" for scene in scenes]
        return [Clip(video.stem, video, load_truth(video.with_suffix(".json"))) for video in videos]


def default_root() -> Path:
    """Where clips are kept unless it is said otherwise."""
    cache = os.environ.get("XDG_CACHE_HOME")
    return (Path(cache) if cache else Path.home() / ".cache") / "deixis" / "clips"


def find_simulator() -> Simulator:
    """The simulator that is installed here. Raises ClipError where none is, or where it cannot be loaded."""
    try:
        return Simulator(
            version=version(SIMULATOR),
            kinds=import_module(f"{PACKAGE}.scene").KINDS,
            draw=import_module(f"{PACKAGE}.draw"),
            jobs=import_module(f"{PACKAGE}.jobs"),
            progress=import_module(f"{PACKAGE}.progress"),
        )
    except PackageNotFoundError:
        hint = f"pip install {SIMULATOR} (in a checkout: pip install ./simulation)"
        raise ClipError(f"{SIMULATOR} is not installed: {hint}") from None
    except ImportError as error:
        raise ClipError(f"{SIMULATOR} cannot be loaded: {error}") from None
