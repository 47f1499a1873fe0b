"""`deixis run`: router and all stages as processes on this machine, a source played through them, the answers named."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from deixis_runtime.host import SOURCE, HostFailed, HostOptions
from deixis_schemas import topics
from rich.console import Console

from . import wording
from .live_view import view_for
from .options import DEMO_ROBOT, CommandError, add_host, add_json, add_robot, host_options, quoted, read_site, seconds
from .play import PlayResult, play
from .shown import show_by_all
from .source import Source, read_source
from .views import file_view

EXPECTED_MISSED = 1
ENOUGH_ANSWERED = 0.8


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "run", help="run everything on this machine and name what is pointed at", description=__doc__
    )
    parser.add_argument("source", metavar="SOURCE", help="device number, file, folder of pictures or URL")
    add_robot(parser, default=DEMO_ROBOT)
    add_host(parser)
    parser.add_argument("--lockstep", action="store_true", help="feed a frame when the last is answered: reproducible")
    parser.add_argument("--loop", action="store_true", help="play a file again and again")
    add_out(parser)
    parser.add_argument(
        "--view", type=Path, metavar="FILE.rrd", help="draw the run into a file for Rerun's viewer, with the pictures"
    )
    parser.add_argument("--expect", metavar="POI_ID", help="succeed only if the single final answer is exactly this POI")
    parser.add_argument("--timeout", type=seconds, metavar="SECONDS", help="give up when the source has not ended by then")
    add_json(parser, "print one JSON document at the end, and nothing before")
    parser.set_defaults(run=run)


def add_out(parser: argparse.ArgumentParser) -> None:
    """--out and --pictures."""
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="write NAME.jsonl there, a line per message published, and NAME.mcap for replay"
    )
    parser.add_argument(
        "--pictures", action="store_true", help="with --out: NAME.mcap holds the frames as well (raw ones are 27 MB a second)"
    )


def out_options(given: argparse.Namespace, name: str, played: Path | None = None) -> dict[str, Any]:
    """What `play` is to write, of a run of this name. Files of a run before are begun anew, but not the one that is `played`.

    Raises CommandError.
    """
    if given.out is None and given.pictures:
        raise CommandError("--pictures goes with --out")
    mcap = None if given.out is None else given.out / f"{name}.mcap"
    if mcap is not None and mcap.exists():
        if played is not None and mcap.samefile(played):
            raise CommandError(f"'{mcap}' is what is to be played, and would be written over; give another --out")
        _remove(mcap)
    show = None if mcap is None else show_by_all(given.site)
    return {"name": name, "out": given.out, "mcap": mcap, "pictures": given.pictures, "show": show}


def _remove(mcap: Path) -> None:
    try:
        mcap.unlink()
    except OSError as error:
        raise CommandError(f"--out {mcap}: {error.strerror}") from None


def run(given: argparse.Namespace) -> int:
    """Play SOURCE. 0 when done (for live sources and --loop also on Ctrl-C), 1 with the cause, 130 on Ctrl-C before the end."""
    source = read_source(given.source)
    options, names = _options(given, source)
    drawn = None if given.view is None else file_view(given.view, given.site, given.robot)
    # What is worth reading of the stages' own logs is shown by the view; they still report what is wrong.
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    console = Console()
    view = nullcontext() if given.json else view_for(console, names, options.stages)
    with view as shown:
        result = play(
            options,
            **out_options(given, source.name),
            on_message=shown.hear if shown else None,
            beside=drawn,
            timeout_s=given.timeout,
        )
    names |= result.names
    if given.json:
        print(json.dumps(document(given.robot, given.source, result)))
    else:
        print_answers(console, result, names)
    return exit_status(result, endless=source.live or given.loop, expected=given.expect)


def exit_status(result: PlayResult, *, endless: bool, expected: str | None, command: str = "run") -> int:
    """The status of a run, with its cause on standard error. An `endless` source is ended by an interrupt in good order."""
    if result.failure is not None and result.signal is None:
        print(f"deixis {command}: {result.failure}", file=sys.stderr)
        return 1
    if result.signal is not None and not (endless and result.frames):
        print(f"deixis {command}: stopped by {signal.Signals(result.signal).name} before the end", file=sys.stderr)
        return 128 + result.signal
    if expected is not None and [target.poi_ids for target in result.targets] != [[expected]]:
        answers = "; ".join(" or ".join(target.poi_ids) or "no answer" for target in result.targets) or "no pointing at all"
        print(f"deixis {command}: expected the one answer '{expected}', but got: {answers}", file=sys.stderr)
        return EXPECTED_MISSED
    return 0


def print_answers(console: Console, result: PlayResult, names: dict[str, str]) -> None:
    """The final answers, and how the run fared, as text; nothing for a source that gave no frame."""
    for target in result.targets:
        console.out(f"\n{wording.answer_text(target, names)}", highlight=False)
    counts = result.counters
    answered = counts.get("Belief", 0)
    if not (result.frames or answered):
        return
    if not result.targets:
        console.out("\nNobody was seen pointing.", highlight=False)
    # A recording may speak for the stages behind the camera alone: then nobody sends frames, and they are answered.
    played = f"\n{result.frames or answered} frames in {result.wall_s:.1f} s, {answered} answered"
    rejected = f", {counts['rejected']} messages refused" if counts.get("rejected") else ""
    console.out(f"{played}{rejected}.", highlight=False)
    share = answered / (result.frames or answered)
    fusion = result.health.get(topics.BELIEF.stage)
    if not share and fusion is not None and fusion.reason:
        console.out(f"No frame was answered; fusion is {fusion.state}: {fusion.reason}", highlight=False)
    elif 0 < share < ENOUGH_ANSWERED:
        console.out(
            f"Only {share:.0%} of the frames were answered: this machine is too slow or too busy for the source's rate. "
            "Free it, lower the rate (--set camera.rate_hz=15), or play recordings with --lockstep.",
            highlight=False,
        )


def document(robot: str, source: str, result: PlayResult) -> dict[str, Any]:
    """The JSON document of `--json`."""
    return {
        "robot": robot,
        "source": result.camera.source if result.camera else source,
        "frames": result.frames,
        "answers": [target.model_dump(mode="json") for target in result.targets],
        "camera": result.camera.model_dump(mode="json") if result.camera else None,
        "health": {stage: health.model_dump(mode="json") for stage, health in sorted(result.health.items())},
        "counters": dict(sorted(result.counters.items())),
        "failure": result.failure,
        "wall_s": round(result.wall_s, 3),
    }


def _options(given: argparse.Namespace, source: Source) -> tuple[HostOptions, dict[str, str]]:
    site = read_site(given.site)
    settings = {"source": quoted(source.setting)} | ({"loop": "true"} if given.loop else {})
    try:
        options = host_options(given, settings, lockstep=given.lockstep)
    except HostFailed as error:
        raise CommandError(str(error)) from None
    if SOURCE not in options.stages:
        raise CommandError(f"'deixis run' plays a source and so needs the {SOURCE}; 'deixis up' starts part of the stages")
    return options, {poi.poi_id: poi.name for poi in site.pois} if site else {}
