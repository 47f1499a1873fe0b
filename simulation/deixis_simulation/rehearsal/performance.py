"""A rehearsal's run: processes of their own render the clips, and each is played to the real system as soon as it is there."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import yaml
from deixis_cli.options import quoted
from deixis_evaluation.clips import Clip, ClipError, load_truth
from deixis_evaluation.evaluate import EvaluationOptions, evaluate_clip
from deixis_evaluation.truth_site import calibration_content
from deixis_runtime.host import SOURCE
from deixis_schemas import topics

from ..clip_files import ClipFiles
from ..jobs import Progress, render_all
from ..scene import Scene
from .aims import Aim
from .answers import Answer, answer_of
from .ground import Ground
from .trials import Trial


@dataclass(frozen=True)
class Venue:
    """Where a rehearsal takes place: the site's own file, its clips' folder, and settings of the stages by stage."""

    site: Path
    ground: Ground
    aims: Sequence[Aim]
    clips: Path
    stages: tuple[str, ...]
    sets: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def perform(
    trials: Sequence[Trial], venue: Venue, jobs: int, hear: Callable[[Answer], None], tick: Callable[[Scene], None]
) -> None:
    """Tell `hear` the answer to each trial, in the order in which clips are ready; `tick` is called for each frame rendered.

    Clips that are there already are played first. Raises Interrupted (of jobs or of evaluate) when stopped; what was heard
    until then stands. OSError where the folder cannot be written.
    """
    of_scene = {trial.scene.name: trial for trial in trials}

    # Played from here, between two messages of the renderers: these go on meanwhile, and one is not replaced until the clip
    # is over, so that the system has its processor.
    def play(scene: Scene) -> None:
        hear(play_trial(of_scene[scene.name], venue))

    def fail(scene: Scene, why: str) -> None:
        hear(_unplayed(of_scene[scene.name], why))

    progress = Progress(frame=tick, ends=play, skips=play, fails=fail)
    render_all([trial.scene for trial in trials], venue.clips, jobs=jobs, progress=progress)


def play_trial(trial: Trial, venue: Venue) -> Answer:
    """Play one clip to the system with the site's own file. What goes wrong stands in the answer. Raises Interrupted."""
    name = trial.scene.name
    try:
        files = ClipFiles(venue.clips, name)
        clip = Clip(name, files.video, load_truth(files.truth))
    except ClipError as error:
        return _unplayed(trial, str(error))
    # A folder directly below the system's temporary one: each clip meets a registry that holds the site's POIs alone.
    with tempfile.TemporaryDirectory(prefix="deixis-rehearse-") as folder:
        sets = settings_for(clip, venue.ground, Path(folder), venue.sets)
        options = EvaluationOptions(stages=venue.stages, lockstep=True, sets=sets, site=venue.site)
        score = evaluate_clip(clip, options)
    own = [aim for aim in venue.aims if aim.place == trial.place]
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


def _unplayed(trial: Trial, failure: str) -> Answer:
    return Answer(trial.scene.name, trial.place.letter, trial.aim.poi.poi_id if trial.aim else None, failure=failure)
