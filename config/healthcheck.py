"""Whether a service in this container works: HEALTHCHECK of the image. Usage: healthcheck.py router|STAGE

Of the router, that it accepts on its socket; of a stage, that its loop answers a get of its health and says it is not failed.
Prints what is wrong and exits 1.
"""

from __future__ import annotations

import os
import socket
import sys

from deixis_runtime.session import Unreachable, exit_now, open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health

SOCKET = "/run/deixis/router.sock"
TIMEOUT_S = 2.0


def router_problem() -> str:
    """What is wrong with the router; empty if nothing."""
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(TIMEOUT_S)
        try:
            probe.connect(SOCKET)
        except OSError as error:
            return f"router: {SOCKET}: {error.strerror or error}"
    return ""


def stage_problem(stage: str, robot: str) -> str:
    """What is wrong with the stage; empty if nothing."""
    key = topics.HEALTH.key(robot, stage=stage)
    try:
        with open_client(f"unixsock-stream/{SOCKET}", shared_memory=False) as session:
            for reply in session.get(key, timeout=TIMEOUT_S):
                if reply.ok is None:
                    continue
                health = codec.decode(Health, reply.ok.payload.to_bytes(), str(reply.ok.encoding))
                return f"{stage}: {health.reason}" if health.state == "failed" else ""
    except (Unreachable, codec.CodecError) as error:
        return f"{stage}: {error}"
    return f"{stage}: no answer on {key} within {TIMEOUT_S:g} s"


def main() -> None:
    """Check the service named on the command line."""
    service = sys.argv[1]
    problem = router_problem() if service == "router" else stage_problem(service, os.environ["DEIXIS_ROBOT"])
    if problem:
        print(problem, file=sys.stderr)
    exit_now(1 if problem else 0)


if __name__ == "__main__":
    main()
