"""`deixis replay`: a recording speaks for some of the stages, the others run on it, and what is pointed at is named."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from deixis_runtime.host import SOURCE, HostFailed, HostOptions, chosen_stages
from deixis_schemas import topics
from deixis_schemas.topics import By
from rich.console import Console

from .live_view import view_for
from .mcap_file import McapFileError, keys_in
from .options import CommandError, add_host, add_json, add_robot, host_options, read_site
from .play import play
from .replayer import Replayer
from .run import add_out, document, exit_status, out_options, print_answers

DEFAULT_AS = topics.FRAME.stage
# Without one of these a stage has nothing to answer, or to say where: a replay in lockstep would wait in vain for each frame.
NEEDED = {topics.FRAME: "pictures", topics.TRACKS: "tracks"}
KEEPER = topics.POI.stage


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("replay", help="play a recording in the place of some stages", description=__doc__)
    parser.add_argument("file", type=Path, metavar="FILE.mcap", help="a recording of 'deixis record' or 'deixis run --out'")
    parser.add_argument(
        "--as",
        dest="spoken_for",
        default=DEFAULT_AS,
        metavar="STAGES",
        help="stages that the recording speaks for (default: %(default)s)",
    )
    add_robot(parser, default="demo")
    add_host(parser)
    parser.add_argument("--lockstep", action="store_true", help="feed a frame when the last is answered: reproducible")
    add_out(parser)
    parser.add_argument("--expect", metavar="POI_ID", help="succeed only if the single final answer is exactly this POI")
    add_json(parser, "print one JSON document at the end, and nothing before")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Play FILE to its end. 0 when done, 1 with the cause, 130 on Ctrl-C. Raises CommandError."""
    try:
        options, replayer, names = _prepare(given)
    except (HostFailed, McapFileError) as error:
        raise CommandError(str(error)) from None
    os.environ.setdefault("DEIXIS_LOG", "WARNING")
    console = Console()
    with nullcontext() if given.json else view_for(console, names, options.stages) as shown:
        result = play(
            options,
            **out_options(given, given.file.stem, given.file),
            on_message=shown.hear if shown else None,
            beside=replayer.on,
        )
    result.failure = result.failure or replayer.failure or _unanswered(replayer)
    names |= result.names
    if given.json:
        print(json.dumps(document(given.robot, str(given.file), result)))
    else:
        print_answers(console, result, names)
    return exit_status(result, endless=False, expected=given.expect, command="replay")


def _prepare(given: argparse.Namespace) -> tuple[HostOptions, Replayer, dict[str, str]]:
    """What is to run, and what speaks for the rest. Raises CommandError, HostFailed or McapFileError."""
    spoken_for = tuple(name.strip() for name in given.spoken_for.split(",") if name.strip())
    if not spoken_for:
        raise CommandError("--as names no stage")
    chosen_stages(spoken_for, ())  # known ones only
    held = stages_in(given.file)
    for name in spoken_for:
        if name not in held:
            there = ", ".join(sorted(held)) or "of no stage"
            raise CommandError(f"'{given.file}' holds no messages of '{name}' about frames (it holds those of: {there})")
    given.without = [*given.without, *spoken_for, SOURCE]
    site = read_site(given.site)
    options = host_options(given, lockstep=given.lockstep)
    _check_fed(options.stages, spoken_for)
    replayer = Replayer(
        given.file, given.robot, spoken_for, options.stages, lockstep=given.lockstep, pois=site is None or KEEPER in spoken_for
    )
    return options, replayer, {poi.poi_id: poi.name for poi in site.pois} if site else {}


def stages_in(path: Path) -> set[str]:
    """Stages whose answers to frames, or frames, the recording holds. Raises McapFileError."""
    found = {topics.topic_of(key) for key in keys_in(path)}
    return {topic.stage for topic in found if topic is not None and topic.by is By.FRAME}


def _check_fed(running: Sequence[str], spoken_for: Sequence[str]) -> None:
    """Raises CommandError where a stage would run without what it works on."""
    for topic, what in NEEDED.items():
        if topic.stage in (*running, *spoken_for):
            continue
        deprived = [name for name in running if topic in topics.INPUTS.get(name, ())]
        if deprived:
            also = ",".join((topic.stage, *spoken_for))
            raise CommandError(
                f"{' and '.join(deprived)} would run without {what}: give --as {also}, or --except {','.join(deprived)}"
            )


def _unanswered(replayer: Replayer) -> str | None:
    return f"{replayer.unanswered} frames were not answered in time" if replayer.unanswered else None
