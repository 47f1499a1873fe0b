"""`deixis doctor`: what is wrong with a running system, and what to do about it. Changes nothing."""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

import zenoh
from deixis_runtime.session import Unreachable, open_client
from deixis_schemas import topics
from deixis_schemas.messages import Health, Poi
from rich.console import Console
from rich.text import Text

from .checks import Finding, Listening, findings
from .gets import get_all
from .inbox import Inbox
from .options import add_connect, add_json, add_robot
from .system import look

LISTEN_S = 2.5
CPU_OVER_S = 0.3
MARKS = {"ok": ("ok   ", "green"), "note": ("note ", "yellow"), "wrong": ("WRONG", "red")}


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("doctor", help="what is wrong, and what to do", description=__doc__)
    add_robot(parser)
    add_connect(parser)
    add_json(parser, "print one JSON document")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Examine the system. 1 when something is wrong."""
    found = examine(given.connect, given.robot)
    wrong = [finding for finding in found if finding.level == "wrong"]
    if given.json:
        print(json.dumps({"robot": given.robot, "wrong": len(wrong), "findings": [vars(finding) for finding in found]}))
    else:
        _print(found)
    return 1 if wrong else 0


def examine(endpoint: str, robot: str) -> list[Finding]:
    """All findings, the router's first."""
    try:
        with open_client(endpoint, shared_memory=False) as session:
            return [Finding("ok", f"the router at {endpoint} answers"), *_examine(session, robot)]
    except Unreachable as error:
        return [Finding("wrong", str(error), "check the endpoint, the network and that host's 'deixis up --listen'")]


def _examine(session: zenoh.Session, robot: str) -> list[Finding]:
    inbox = Inbox()
    subscriber = session.declare_subscriber(topics.HEALTH.key(robot, stage="*"), inbox.store)
    began_s = time.monotonic()
    system = look(session, robot, CPU_OVER_S)
    if not system.processes:
        advice = "is the robot's name right? Does access control deny liveliness and gets to us?"
        return [Finding("wrong", f"no stage of robot '{robot}' is alive or answers", advice)]
    fusion = any(process.stage == topics.POI.stage and process.health is not None for process in system.processes)
    reach = edits_reach_fusion(session, robot) if fusion else None
    time.sleep(max(0.0, LISTEN_S - (time.monotonic() - began_s)))
    subscriber.undeclare()  # type: ignore[no-untyped-call]
    heard = frozenset(item.message.stage for item in inbox.take_all() if isinstance(item.message, Health))
    return findings(system, Listening(heard, reach))


def edits_reach_fusion(session: zenoh.Session, robot: str) -> bool:
    """Ask for an operation that does not exist: fusion refuses it, and nothing is changed; silence means that it is denied."""
    stored, refused = get_all(session, f"{topics.POI.key(robot, id='doctor')}?op=none", Poi)
    return bool(stored or refused)


def _print(found: list[Finding]) -> None:
    console = Console(soft_wrap=True)
    for finding in found:
        mark, style = MARKS[finding.level]
        console.print(
            Text.assemble((mark, style), " ", finding.what, f"\n        -> {finding.advice}" if finding.advice else "")
        )
