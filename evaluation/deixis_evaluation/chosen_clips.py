"""The clips that `deixis eval` is to score: those of a folder, or those of the simulator's seeds, made where missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from rich.console import Console

from .camera_pose import path_of
from .clip_cache import ClipCache, default_root, find_simulator
from .clips import Clip, ClipError, load_clips
from .seeds import parse_seeds, say_set


@dataclass(frozen=True)
class Choice:
    """What was asked for: a folder or seeds, and of these the clips whose names fit `pattern`.

    kinds, cache, jobs, plain: of the simulator's clips; none for the usual place, and a job a processor.
    """

    folder: Path | None
    seeds: str | None
    pattern: str = "*"
    kinds: tuple[str, ...] = ()
    cache: Path | None = None
    jobs: int | None = None
    plain: bool = False


@dataclass(frozen=True)
class Chosen:
    """The clips and where they lie; `seeds` as A:B, none for a folder; `plain`: whether their scenes are."""

    clips: Sequence[Clip]
    folder: Path
    seeds: str | None = None
    plain: bool = False


def choose(choice: Choice, console: Console) -> Chosen:
    """Load the clips, and first have those made that are missing. Raises ClipError or SeedsError."""
    if (choice.folder is None) == (choice.seeds is None):
        raise ClipError("give either a folder of labelled clips or --seeds A:B")
    if choice.seeds is not None:
        chosen = _of_seeds(choice, choice.seeds, console)
    else:
        if choice.kinds or choice.cache is not None or choice.plain:
            raise ClipError("--kinds, --cache and --plain go with --seeds; of a folder choose with --only-clips")
        assert choice.folder is not None
        chosen = Chosen(load_clips(choice.folder, choice.pattern), choice.folder)
    for clip in chosen.clips:
        _check_path(clip)
    return chosen


def _of_seeds(choice: Choice, text: str, console: Console) -> Chosen:
    seeds = parse_seeds(text)
    cache = ClipCache(choice.cache or default_root(), find_simulator(), choice.kinds, choice.plain)
    console.print(f"{say_set(seeds)}; clips in {cache.folder}", markup=False, highlight=False, soft_wrap=True)
    clips = [clip for clip in cache.clips(seeds.numbers, choice.jobs) if fnmatchcase(clip.name, choice.pattern)]
    if not clips:
        raise ClipError(f"no clip of seeds {seeds} is named {choice.pattern}")
    return Chosen(clips, cache.folder, str(seeds), choice.plain)


def _check_path(clip: Clip) -> None:
    """Refuse a camera that moves as no robot does before anything is played. Raises ClipError that names the clip."""
    try:
        path_of(clip.truth)
    except ClipError as error:
        raise ClipError(f"label file of '{clip.video}': {error}") from None
