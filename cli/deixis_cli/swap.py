"""`deixis swap`: another process takes the place of a running stage between two frames; the other stages notice nothing.

The newcomer comes up standing by: it works on all that comes and is not heard. It is looked at beside the old one; then it asks
the old one for its place, which names the frame from which on the newcomer is heard. When that has gone well, the old one ends.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

import zenoh
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import open_client
from deixis_runtime.settings import checked_name
from deixis_schemas import topics

from .newcomer import GivenNewcomer, Newcomer, OwnNewcomer, SupervisedNewcomer
from .options import CommandError, add_connect, add_json, add_robot, seconds
from .swap_count import Cost
from .swap_procedure import Refusal, SwapProcedure

WHY_NOT = {
    "camera": "a device can be opened by one process at a time, and another camera begins another run: restart it",
    "fusion": "it holds the registry of points of interest and the open episodes, which cannot be in two processes: restart it",
}
WATCH_S = 3.0


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("swap", help="replace a running stage between two frames", description=__doc__)
    parser.add_argument("stage", metavar="STAGE", choices=topics.STAGES, help=", ".join(topics.SWAPPABLE))
    add_robot(parser)
    add_connect(parser)
    newcomer = parser.add_mutually_exclusive_group()
    newcomer.add_argument(
        "--command",
        dest="start",
        metavar="'COMMAND'",
        help="start the newcomer by it, and stay with it until Ctrl-C: {robot} and {connect} in it become the robot's name and "
        "the router's endpoint (default: the supervisor of the stage starts its own command anew)",
    )
    newcomer.add_argument("--instance", type=checked_name, metavar="NAME", help="a process that stands by already")
    parser.add_argument(
        "--set", action="append", default=[], dest="sets", metavar="NAME=VALUE", help="setting of the stage started anew"
    )
    parser.add_argument(
        "--watch",
        type=seconds,
        default=WATCH_S,
        metavar="SECONDS",
        help="how long the newcomer is watched before the old one ends (default: %(default)s)",
    )
    add_json(parser, "print one JSON document")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Swap; 0 when the newcomer has the place. Raises CommandError with the reason where that is not so, or Unreachable."""
    if given.stage in WHY_NOT:
        raise CommandError(f"{given.stage} cannot be swapped while it runs: {WHY_NOT[given.stage]}")
    if given.sets and (given.start or given.instance):
        raise CommandError("--set is for a stage that its supervisor starts anew; a command or instance has its own settings")
    with Interrupts() as interrupts, open_client(given.connect, shared_memory=False) as session:
        procedure = SwapProcedure(session, given.robot, given.stage, stopped=interrupts.requested, advise=_advise)
        try:
            old = procedure.incumbent()
            with _newcomer(given, session, old) as newcomer:
                instance = procedure.await_standing_by(newcomer)
                procedure.examine(old, instance, newcomer)
                newcomer.keep(procedure.heard_now)
                cost = procedure.hand_over(old, instance, newcomer, given.watch)
                _report(given, old, instance, cost)
                if newcomer.ours:
                    return _stay(given, newcomer, interrupts)
        except Refusal as refusal:
            raise CommandError(str(refusal)) from None
    return 0


@contextmanager
def _newcomer(given: argparse.Namespace, session: zenoh.Session, old: str) -> Iterator[Newcomer]:
    """Who is to take the place; what we have started and what did not get it is ended."""
    newcomer: Newcomer
    if given.start is not None:
        newcomer = OwnNewcomer(given.start, given.robot, given.connect)
    elif given.instance is not None:
        newcomer = GivenNewcomer(given.instance)
    else:
        newcomer = SupervisedNewcomer(session, given.robot, given.stage, tuple(given.sets), old)
    try:
        yield newcomer
    finally:
        newcomer.end()


def _report(given: argparse.Namespace, old: str, new: str, cost: Cost) -> None:
    if given.json:
        document = {"stage": given.stage, "robot": given.robot, "old": old, "new": new, **asdict(cost)}
        print(json.dumps(document), flush=True)
        return
    print(f"{given.stage}: {new} has the place of {old}", flush=True)
    print(
        f"{cost.gap_frames} frames without an answer in between ({cost.gap_s * 1e3:.0f} ms from answer to answer, "
        f"{cost.usual_s * 1e3:.0f} ms usually), {cost.twice} answered twice",
        flush=True,
    )


def _advise(text: str) -> None:
    print(f"deixis swap: {text}", file=sys.stderr, flush=True)


def _stay(given: argparse.Namespace, newcomer: Newcomer, interrupts: Interrupts) -> int:
    """Be the one whom the newcomer belongs to."""
    _advise(f"{given.stage} runs here until Ctrl-C; then its supervisor, if it has one, starts it again as it was")
    while not interrupts.wait(0.1):
        if ended := newcomer.ended():
            raise CommandError(f"the newcomer has ended ({ended}): a supervisor of {given.stage} starts it again as it was")
    return 0
