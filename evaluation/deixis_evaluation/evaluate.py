"""Plays labelled clips through the whole system, each with fresh processes and a fresh registry, and scores them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from deixis_cli.play import PlayResult, play
from deixis_runtime.host import HostOptions
from deixis_schemas.messages import Belief, Message

from .clip_score import ClipScore, failed_clip, score_clip
from .clips import Clip, ClipError
from .interrupted import Interrupted
from .recording import RecordingError, read_recording
from .speaker import Speakers
from .stand_ins import speakers_for
from .truth_site import write_site

ROBOT = "eval"
START_S = 60.0
FRAME_S = 0.7
"""Longest time a frame may take on average before a clip is given up."""


@dataclass(frozen=True)
class EvaluationOptions:
    """How clips are played. `stages` are those that run, `truth` those in whose place the truth speaks.

    `out` is the folder that gets NAME.jsonl, `sets` are settings of stages. `site`: a site file to play clips with, in place of
    one made from the truth; `sets` then name source and registry. guests: who stands in the place of stages (`lineups`).
    """

    stages: tuple[str, ...]
    truth: tuple[str, ...] = ()
    lockstep: bool = False
    out: Path | None = None
    sets: dict[str, tuple[str, ...]] = field(default_factory=dict)
    site: Path | None = None
    guests: Mapping[str, str] = field(default_factory=dict)


def evaluate_clip(
    clip: Clip,
    options: EvaluationOptions,
    on_frame: Callable[[], None] | None = None,
    on_message: Callable[[Message], None] | None = None,
) -> ClipScore:
    """Play one clip and score it. Raises Interrupted.

    `on_frame` is called for each frame answered, `on_message` for each message, without its image bytes. What goes wrong with
    the clip stands in the score's `failure`.
    """
    # A folder directly below the system's temporary one: the POI registry is made anew for each clip.
    with tempfile.TemporaryDirectory(prefix="deixis-eval-") as folder:
        site = options.site or write_site(clip, Path(folder))
        out = options.out or Path(folder)
        try:
            speakers = Speakers(speakers_for(clip, options.truth, lockstep=options.lockstep), ROBOT, lockstep=options.lockstep)
        except ClipError as error:
            return failed_clip(clip.name, clip.truth, str(error))
        result = _play(clip, site, out, options, speakers, on_frame, on_message)
        if result.signal is not None:
            raise Interrupted(result.signal)
        failure = result.failure or _incomplete(result) or next(iter(speakers.failures), None)
        if failure is not None:
            return failed_clip(clip.name, clip.truth, failure)
        try:
            recording = read_recording(out / f"{clip.name}.jsonl")
        except RecordingError as error:
            return failed_clip(clip.name, clip.truth, str(error))
    if recording.interruption is not None:
        return failed_clip(clip.name, clip.truth, recording.interruption)
    return score_clip(clip.name, clip.truth, recording, lockstep=options.lockstep)


def _play(
    clip: Clip,
    site: Path,
    out: Path,
    options: EvaluationOptions,
    speakers: Speakers,
    on_frame: Callable[[], None] | None,
    on_message: Callable[[Message], None] | None,
) -> PlayResult:
    def hear(_: str, message: Message) -> None:
        speakers.hear(message)
        if on_message is not None:
            on_message(message)
        if on_frame is not None and isinstance(message, Belief):
            on_frame()

    host = HostOptions(
        robot=ROBOT,
        stages=options.stages,
        site=site,
        listen=(),
        lockstep=options.lockstep,
        sets=dict(options.sets),
        guests=options.guests,
    )
    timeout_s = START_S + FRAME_S * len(clip.truth.frames)
    return play(host, out=out, name=clip.name, on_message=hear, beside=speakers.join, timeout_s=timeout_s)


def _incomplete(result: PlayResult) -> str | None:
    """Why a recording must not be scored: it would charge the stages with what we have missed."""
    if result.frames == 0:
        return "no frame was published"
    lost = result.counters.get("lost", 0)
    return f"{lost} messages were lost by the recorder: this machine is too slow for it" if lost else None
