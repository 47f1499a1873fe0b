"""Whether a service of this host works: `python -m deixis_runtime.healthcheck router|STAGE`.

Of the router, that it opens a session on its socket (one that is stopped still accepts connections); of a stage, that its loop
answers a get of its health and says it has not failed. Prints what is wrong and exits 1.
"""

from __future__ import annotations

import argparse
import errno
import os
import sys

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health

from .session import Unreachable, exit_now, first_line, open_client
from .settings import checked_name

SOCKET = "/run/deixis/router.sock"
TIMEOUT_S = 2.0


def router_problem(path: str) -> str:
    """What is wrong with the router on this socket; empty if nothing."""
    if not os.path.exists(path):
        return f"router: {path}: {os.strerror(errno.ENOENT)}"
    try:
        with open_client(f"unixsock-stream/{path}", shared_memory=False):
            return ""
    except Unreachable as error:
        return f"router: {error}"


def stage_problem(stage: str, robot: str, path: str) -> str:
    """What is wrong with the stage, asked by the router on this socket; empty if nothing."""
    key = topics.HEALTH.key(robot, stage=stage)
    try:
        with open_client(f"unixsock-stream/{path}", shared_memory=False) as session:
            answers = [reply.ok for reply in session.get(key, timeout=TIMEOUT_S) if reply.ok is not None]
        if not answers:
            return f"{stage}: no answer on {key} within {TIMEOUT_S:g} s"
        return health_problem(answers[0].payload.to_bytes(), str(answers[0].encoding))
    except (Unreachable, codec.CodecError) as error:
        return f"{stage}: {error}"
    except zenoh.ZError as error:
        return f"{stage}: {first_line(error)}"


def health_problem(payload: bytes, encoding: str) -> str:
    """What a stage's health says is wrong; empty if nothing. Raises codec.CodecError."""
    health = codec.decode(Health, payload, encoding, max_bytes=topics.HEALTH.max_bytes)
    return f"{health.stage}: {health.reason}" if health.state == "failed" else ""


def main(argv: list[str] | None = None) -> int:
    """Check the service named on the command line. Exit status 1 when it does not work."""
    parser = argparse.ArgumentParser(prog="python -m deixis_runtime.healthcheck", description=main.__doc__)
    parser.add_argument("service", type=checked_name, metavar="router|STAGE")
    parser.add_argument("--robot", type=checked_name, default=os.environ.get("DEIXIS_ROBOT"), help="default: $DEIXIS_ROBOT")
    parser.add_argument("--socket", default=SOCKET, metavar="PATH", help="the router's (default: %(default)s)")
    given = parser.parse_args(argv)
    if given.service == "router":
        problem = router_problem(given.socket)
    elif given.robot is None:
        parser.error("--robot or DEIXIS_ROBOT is needed")
    else:
        problem = stage_problem(given.service, given.robot, given.socket)
    if problem:
        print(problem, file=sys.stderr)
    return 1 if problem else 0


if __name__ == "__main__":
    exit_now(main())
