"""`deixis up`: the router and a part of the stages on this host, until told to stop."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import Any

from deixis_runtime.host import Host, HostFailed, HostOptions
from deixis_runtime.interrupts import Interrupts

from .options import add_host, add_robot, host_options, read_site

log = logging.getLogger("deixis-up")

TURN_S = 0.05


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("up", help="run part of the stages on this host, until told to stop", description=__doc__)
    add_robot(parser)
    add_host(parser)
    parser.add_argument(
        "--connect", action="append", default=[], metavar="ENDPOINT", help="router of another host; may be given again"
    )
    parser.add_argument(
        "--zenoh-config", type=Path, metavar="FILE", help="Zenoh configuration (json5) of this host's router, e.g. for TLS"
    )
    parser.add_argument("--lockstep", action="store_true", help="feed a frame when the last is answered: reproducible")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Run until SIGTERM or Ctrl-C: then 0. Raises HostFailed when the router or all stages are given up.

    A single stage that is given up leaves the others running: fusion does without its evidence, and says so.
    """
    read_site(given.site)
    config = given.zenoh_config.resolve() if given.zenoh_config is not None else None
    options = host_options(given, connect=tuple(given.connect), zenoh_config=config, lockstep=given.lockstep)
    with Interrupts() as interrupts:
        try:
            _run_host(options, interrupts)
        except HostFailed:
            if not interrupts.requested():  # what fails while we stop is no fault
                raise
    return 0


def _run_host(options: HostOptions, interrupts: Interrupts) -> None:
    with Host(options) as host:
        host.start(stopped=interrupts.requested)
        log.info("robot %s: %s started, reached at %s", options.robot, ", ".join(options.stages), ", ".join(options.listen))
        while not interrupts.wait(TURN_S):
            host.poll()
        log.info("stopping")
