"""`deixis doctor`: what is wrong with a running system and with this machine, and what to do about it. Changes nothing, and
writes nothing but the picture of --camera.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import zenoh
from deixis_runtime.certificate_check import read, who_may_not_edit
from deixis_runtime.certificates import certificates_of
from deixis_runtime.endpoint import is_guarded
from deixis_runtime.finding import CAMERA_LOOKS, CameraLook, Finding
from deixis_runtime.session import Unreachable, open_client
from deixis_runtime.unanswered import why_unanswered
from deixis_schemas import topics
from deixis_schemas.messages import Health, Poi
from deixis_schemas.topics import By, Delivery
from rich.console import Console
from rich.text import Text

from .checks import Listening, findings
from .gets import get_all
from .inbox import Inbox
from .local import examine_machine
from .options import CommandError, add_connect, add_json, add_robot
from .system import look

LISTEN_S = 2.5
CPU_OVER_S = 0.3
# Frames are left out: they would cross the link once more.
LISTENED = tuple(topic for topic in topics.TOPICS if topic.by is By.FRAME and topic.delivery is not Delivery.BULK_NEWEST)
MARKS = {"ok": ("ok   ", "green"), "note": ("note ", "yellow"), "wrong": ("WRONG", "red")}


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("doctor", help="what is wrong, and what to do", description=__doc__)
    add_robot(parser, required=False)
    add_connect(parser)
    add_json(parser, "print one JSON document")
    parser.add_argument("--source", metavar="SOURCE", help="also open this camera, file or stream here, and take a picture")
    parser.add_argument("--local", action="store_true", help="look at this machine only, at no router and no robot")
    parser.add_argument(
        "--camera",
        nargs="?",
        type=Path,
        const=Path("doctor.png"),
        metavar="FILE.png",
        help="look through the robot's camera, or --source, and draw what the tracker sees (default: doctor.png; written over)",
    )
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Examine the system and this machine. 1 when something is wrong. Raises CommandError."""
    if given.robot is None and not given.local:
        raise CommandError("--robot NAME is needed to look at a running system; --local looks at this machine alone")
    _check_picture(given.camera, given.source)
    looks = camera_looks(given)
    found = [] if given.local else examine(given.connect, given.robot)
    found += examine_machine(given.source)
    for look_through in looks:
        found += look_through(CameraLook(given.source, given.robot, given.connect, given.camera))
    wrong = [finding for finding in found if finding.level == "wrong"]
    if given.json:
        print(json.dumps({"robot": given.robot, "wrong": len(wrong), "findings": [vars(finding) for finding in found]}))
    else:
        _print(found)
    return 1 if wrong else 0


def _check_picture(picture: Path | None, source: str | None) -> None:
    """Before anything is opened: only a picture is written over, and never what is looked at. Raises CommandError."""
    if picture is None:
        return
    if picture.suffix.lower() != ".png":
        raise CommandError(f"--camera {picture}: takes the name of the picture to draw, one that ends in .png")
    if source is not None and _is_of(picture, Path(source.removeprefix("file://"))):
        raise CommandError(f"--camera {picture}: is the --source itself, or in its folder: name another file")
    if picture.is_dir():
        raise CommandError(f"--camera {picture}: is a folder")
    if not picture.parent.is_dir():
        raise CommandError(f"--camera {picture}: there is no folder '{picture.parent}'")


def _is_of(picture: Path, source: Path) -> bool:
    """Whether it is that file, by whatever name, or one of that folder's pictures."""
    if source.is_dir():
        return picture.resolve().parent == source.resolve()
    return picture.exists() and source.exists() and picture.samefile(source)


def camera_looks(given: argparse.Namespace) -> list[Callable[[CameraLook], Iterable[Finding]]]:
    """What examines a camera's pictures, where --camera is given. Raises CommandError where that cannot be done."""
    if given.camera is None:
        return []
    if given.local and given.source is None:
        raise CommandError("--camera with --local needs --source: no system is asked for its frames")
    looks = [point.load() for point in entry_points(group=CAMERA_LOOKS)]
    if not looks:
        raise CommandError("--camera: needs the distribution deixis-calibration, which is not installed here")
    return looks


def examine(endpoint: str, robot: str) -> list[Finding]:
    """Findings about the router and the robot's system behind it, the router's first."""
    try:
        with open_client(endpoint, shared_memory=False) as session:
            return [Finding("ok", f"the router at {endpoint} answers"), *_examine(session, robot, ask_of_rights(endpoint))]
    except Unreachable as error:
        return [error.why or why_unanswered(endpoint, certificates_of())]


def ask_of_rights(endpoint: str) -> str:
    """What to ask where a session is opened and nothing is heard: access control denies without a word."""
    certificates = certificates_of()
    if certificates is None or not is_guarded(endpoint):
        return "Does access control deny liveliness and gets to us?"
    return f"Of rights: is {read(certificates).common_name} on the list of that router (access.json)?"


def _examine(session: zenoh.Session, robot: str, denied: str) -> list[Finding]:
    inbox = Inbox()
    listened = (topics.HEALTH.key(robot, stage="*"), *(topic.key(robot) for topic in LISTENED))
    subscribers = [session.declare_subscriber(key, inbox.store) for key in listened]
    began_s = time.monotonic()
    system = look(session, robot, CPU_OVER_S)
    if not system.processes:
        return [Finding("wrong", f"no stage of robot '{robot}' is alive or answers", f"is the robot's name right? {denied}")]
    fusion = any(process.stage == topics.POI.stage and process.health is not None for process in system.processes)
    reach = edits_reach_fusion(session, robot) if fusion else None
    time.sleep(max(0.0, LISTEN_S - (time.monotonic() - began_s)))
    for subscriber in subscribers:
        subscriber.undeclare()  # type: ignore[no-untyped-call]
    received = inbox.take_all()
    healths = frozenset(item.message.stage for item in received if isinstance(item.message, Health))
    # What came and breaks the contract did come: it is no silence.
    heard = {item.key for item in received} | inbox.rejections.keys()
    paths = {topic.path: topic.key(robot) in heard for topic in LISTENED}
    return findings(system, Listening(healths, reach, who_may_not_edit(certificates_of()) is None, paths))


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
