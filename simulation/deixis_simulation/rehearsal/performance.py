"""A rehearsal's run: processes of their own render the clips, and each is played to the real system as soon as it is there."""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import yaml
from deixis_cli.options import quoted
from deixis_evaluation.clips import Clip, ClipError, load_truth
from deixis_evaluation.evaluate import EvaluationOptions, evaluate_clip
from deixis_evaluation.truth_site import calibration_content
from deixis_runtime.host import SOURCE
from deixis_schemas import topics

from ..scene import Scene
from .aims import Aim
from .answers import Answer, answer_of
from .ground import Ground
from .trials import Trial

Renderer = Callable[[Scene, Path], None]
"""Writes NAME.mp4 and, last, NAME.json of a scene into a folder. Must be picklable: it runs in another process."""


@dataclass(frozen=True)
class Stage:
    """Where a rehearsal takes place: the site's own file, its clips' folder, and settings of the stages by stage."""

    site: Path
    ground: Ground
    aims: Sequence[Aim]
    clips: Path
    stages: tuple[str, ...]
    sets: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def perform(trials: Sequence[Trial], stage: Stage, render: Renderer, jobs: int) -> Iterator[Answer]:
    """Answers to all trials, in the order in which their clips are ready; clips that are there already are played first.

    Raises Interrupted or KeyboardInterrupt when stopped; what was yielded before stands.
    """
    ready = [trial for trial in trials if _is_rendered(trial, stage.clips)]
    for trial in ready:
        yield play_trial(trial, stage)
    wanted = [trial for trial in trials if trial not in ready]
    if not wanted:
        return
    with _renderers(min(jobs, len(wanted))) as pool:
        rendered = {pool.submit(render, trial.scene, stage.clips): trial for trial in wanted}
        for future in as_completed(rendered):
            trial = rendered[future]
            failure = _failure(future)
            yield play_trial(trial, stage) if failure is None else _unplayed(trial, failure)


def play_trial(trial: Trial, stage: Stage) -> Answer:
    """Play one clip to the system with the site's own file. What goes wrong stands in the answer. Raises Interrupted."""
    name = trial.scene.name
    try:
        clip = Clip(name, stage.clips / f"{name}.mp4", load_truth(stage.clips / f"{name}.json"))
    except ClipError as error:
        return _unplayed(trial, str(error))
    # A folder directly below the system's temporary one: each clip meets a registry that holds the site's POIs alone.
    with tempfile.TemporaryDirectory(prefix="deixis-rehearse-") as folder:
        sets = settings_for(clip, stage.ground, Path(folder), stage.sets)
        options = EvaluationOptions(stages=stage.stages, lockstep=True, sets=sets, site=stage.site)
        score = evaluate_clip(clip, options)
    own = [aim for aim in stage.aims if aim.place == trial.place]
    return answer_of(name, trial.place.letter, trial.aim, own, score, clip.truth)


def settings_for(clip: Clip, ground: Ground, folder: Path, given: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """The settings that a rehearsal puts in place of the site's: source, registry, and a pinhole where none is calibrated."""
    camera = [f"source={quoted(str(clip.video.resolve()))}", "loop=false"]
    if ground.pinhole_px is not None:
        pinhole = folder / "pinhole.yaml"
        pinhole.write_text(yaml.safe_dump(calibration_content(clip)), encoding="utf-8")
        camera.append(f"calibration={quoted(str(pinhole))}")
    keeper = topics.POI.stage
    registry = f"registry={quoted(str(folder / 'pois.sqlite'))}"
    # Behind what was given: a rehearsal plays its clips whatever the user sets.
    return {**given, SOURCE: (*given.get(SOURCE, ()), *camera), keeper: (*given.get(keeper, ()), registry)}


def _is_rendered(trial: Trial, folder: Path) -> bool:
    return all((folder / f"{trial.scene.name}{suffix}").exists() for suffix in (".mp4", ".json"))


@contextmanager
def _renderers(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that render. Spawned, for OpenGL does not survive a fork; those at work are let go when we are stopped."""
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin_rendering)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _begin_rendering() -> None:
    """In a rendering process: end quietly at Ctrl-C, and leave the other cores to the other processes."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    os.environ["LP_NUM_THREADS"] = "1"


def _failure(future: Future[None]) -> str | None:
    """Why a clip could not be rendered; none where it is there."""
    try:
        future.result()
    except BrokenProcessPool:
        return "the rendering process ended (out of memory, or OpenGL failed)"
    except Exception as error:
        return f"it could not be rendered: {error}"
    return None


def _unplayed(trial: Trial, failure: str) -> Answer:
    return Answer(trial.scene.name, trial.place.letter, trial.aim.poi.poi_id if trial.aim else None, failure=failure)
