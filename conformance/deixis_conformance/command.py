"""`deixis check-stage`: whether a stage, whoever wrote it, keeps the contract; what it breaks, and what to do about it."""

from __future__ import annotations

import argparse
import json
import signal
import socket
import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

import zenoh
from deixis_cli.mcap_file import McapFileError
from deixis_cli.options import CommandError, add_json
from deixis_runtime.access import FRAME_READERS
from deixis_runtime.certificate_check import whose
from deixis_runtime.certificates import add_certificates, certificates_of
from deixis_runtime.endpoint import is_guarded
from deixis_runtime.router import router_config
from deixis_runtime.session import DEFAULT_ENDPOINT, close, first_line, open_client
from deixis_runtime.settings import checked_name
from deixis_schemas import topics

from .examination import Examination
from .procedure import examine_running, examine_started
from .recording import SHIPPED, Recording, RecordingError, read_recording
from .report import document, print_report, unseen, write_junit
from .results import Result
from .subject import Subject, SubjectError


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("check-stage", help="whether a stage keeps the contract", description=__doc__)
    parser.add_argument("stage", metavar="STAGE", choices=sorted(topics.INPUTS), help=", ".join(topics.INPUTS))
    parser.add_argument(
        "--command",
        dest="start",
        metavar="'COMMAND'",
        help="start the stage for it: {robot} and {connect} in the command become the robot's name and the router's endpoint",
    )
    parser.add_argument("--robot", type=checked_name, metavar="NAME", help="of a running stage: its robot")
    parser.add_argument(
        "--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT", help="of a running stage: its router (default: %(default)s)"
    )
    add_certificates(parser)
    parser.add_argument(
        "--recording", type=Path, default=SHIPPED, metavar="FILE.mcap", help="what to feed (default: one that ships)"
    )
    parser.add_argument("--junit", type=Path, metavar="FILE", help="write JUnit XML there")
    add_json(parser, "print one JSON document")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Check the stage. 1 when it breaks the contract or says nothing. Raises CommandError, Unreachable, SystemExit."""
    if (given.start is None) == (given.robot is None):
        raise CommandError("give --command to start the stage, or --robot (and --connect) of one that runs")
    began_s = time.monotonic()
    try:
        recording = read_recording(given.recording, topics.INPUTS[given.stage])
        results = _examine(given, recording)
    except (McapFileError, RecordingError, SubjectError) as error:
        raise CommandError(str(error)) from None
    seconds = time.monotonic() - began_s
    if given.junit is not None:
        try:
            write_junit(given.junit, given.stage, results, seconds)
        except OSError as error:
            raise CommandError(f"--junit {given.junit}: {error.strerror}") from None
    if given.json:
        print(json.dumps(document(given.stage, results, seconds)))
    else:
        print_report(given.stage, results, seconds)
    return 1 if unseen(results) or any(result.outcome == "failed" for result in results) else 0


def _examine(given: argparse.Namespace, recording: Recording) -> list[Result]:
    with ExitStack() as stack:
        stack.callback(signal.signal, signal.SIGTERM, signal.signal(signal.SIGTERM, _leave))
        if given.start is None:
            refuse_unseen(given.stage, given.connect)
            session = stack.enter_context(open_client(given.connect, shared_memory=False))
            exam = Examination(session, given.robot, given.stage, recording, lambda: True)
            exam.listen(all_keys=False)
            return examine_running(exam, recording)
        endpoint, session = stack.enter_context(own_router())
        # A name of its own: whatever else runs there hears nothing of it.
        robot = f"check-{uuid.uuid4().hex[:8]}"
        subject = Subject(given.start, robot, endpoint)
        exam = Examination(session, robot, given.stage, recording, subject.running)
        exam.listen(all_keys=True)
        stack.enter_context(subject)
        return examine_started(exam, subject, recording)


def refuse_unseen(stage: str, endpoint: str) -> None:
    """Raises CommandError where our certificate is given nothing of what the stage publishes: pictures are private."""
    member = whose(certificates_of()) if is_guarded(endpoint) else None
    if stage == topics.FRAME.stage and member is not None and member.role not in FRAME_READERS:
        raise CommandError(
            f"the certificate of {member} is given no frames, so a {stage} cannot be checked by it: check it on the {stage}'s "
            f"own host, with --connect to the socket of its router, or by the certificate of an edge"
        )


def _leave(number: int, _frame: FrameType | None) -> NoReturn:
    """On the way out the stage that we have started is ended, which otherwise would stay."""
    sys.exit(128 + number)


@contextmanager
def own_router() -> Iterator[tuple[str, zenoh.Session]]:
    """A router on a free port of loopback in this process: its endpoint, and its session, which hears all."""
    zenoh.init_log_from_env_or("error")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    try:
        session = zenoh.open(router_config([endpoint], []))
    except zenoh.ZError as error:
        raise CommandError(f"cannot listen on {endpoint}: {first_line(error)}") from None
    try:
        yield endpoint, session
    finally:
        close(session)
