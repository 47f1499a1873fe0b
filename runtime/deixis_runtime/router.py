"""The router of one host, as a process: stages are its clients, and only it faces the network.

A Python session in router mode routes between clients. It stands in for zenohd, which the same settings serve.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import time
from pathlib import Path

import zenoh

from .certificates import add_certificates, certificates_of
from .interrupts import Interrupts
from .limit import RateLimit
from .link_security import LinkSecurity, SecurityError, cautions, endpoints, secure
from .link_watch import LinkWatch
from .manager import Manager, Unheard
from .memory import settle
from .parent import Parent
from .session import Unreachable, base_config, close, exit_now, first_line, put_settings
from .socket_folder import remove_socket_folder
from .stage import EXIT_CONFIG, EXIT_UNREACHABLE, setup_logging
from .two_links import two_links, without_settings

# A cut link is noticed after the lease; Zenoh's default of 10 s is long for a robot.
LEASE_MS = 2000
# Closing a link that was cut with bytes in its socket takes Zenoh up to 10 s (SO_LINGER, fixed when it was built), on one of
# the two threads that receive. Two such links, as one robot has, and the router is deaf to all its clients for so long: their
# supervisor takes them for hung. So there are threads for the links of eight robots that are cut at once.
RUNTIME = "(rx: (worker_threads: 18))"
OPEN_TIMEOUT_MS = 2000
CHECK_S = 1.0
TURN_S = 0.1

log = logging.getLogger("deixis-router")


def router_config(
    listen: list[str], connect: list[str], file: Path | None = None, security: LinkSecurity | None = None
) -> zenoh.Config:
    """Configuration of a host's router. Peers that are not there yet are tried again and again.

    Raises Unreachable for a bad `file`, SecurityError where it must not start so.
    """
    config = base_config("router", file)
    settings = {
        "transport/unicast/max_links": 2,
        "transport/link/tx/lease": LEASE_MS,
        # It hands on what stages put into shared memory, and lays out 16 MB of its own for nothing.
        "transport/shared_memory/transport_optimization/enabled": False,
        "listen/exit_on_failure": True,
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        # A link that is back is to be found at once. TCP asks ever more seldom: a connection that does not come is begun anew.
        "connect/retry": {"period_init_ms": 250, "period_max_ms": 500, "period_increase_factor": 2},
        "transport/unicast/open_timeout": OPEN_TIMEOUT_MS,
    }
    if file is None:
        put_settings(config, settings)
    if json.loads(config.get_json("transport/unicast/max_links")) > 1:
        connect = [link for endpoint in connect for link in two_links(endpoint)]
    given = {side: json.loads(config.get_json(f"{side}/endpoints")) for side in ("listen", "connect")} if file else {}
    put_settings(config, {"listen/endpoints": listen + _endpoints(given.get("listen"))})
    put_settings(config, {"connect/endpoints": connect + _endpoints(given.get("connect"))})
    secure(config, security or LinkSecurity())
    return config


def main(argv: list[str] | None = None) -> int:
    """Run the router until told to stop. Exit status 69 when it cannot listen, 78 when it must not start so."""
    parser = argparse.ArgumentParser(prog="python -m deixis_runtime.router", description=main.__doc__)
    parser.add_argument("--listen", action="append", default=[], metavar="ENDPOINT")
    parser.add_argument("--connect", action="append", default=[], metavar="ENDPOINT", help="router of another host")
    parser.add_argument("--config", type=Path, metavar="FILE", help="Zenoh configuration (json5) to start from")
    add_certificates(parser)
    parser.add_argument("--insecure", action="store_true", help="listen on the network without TLS all the same")
    parser.add_argument("--frames-stay", action="store_true", help="let no frame leave this host")
    parser.add_argument("--supervised", action="store_true", help="stop when the parent process is gone")
    given = parser.parse_args(argv)
    setup_logging()
    zenoh.init_log_from_env_or("error")
    os.environ.setdefault("ZENOH_RUNTIME", RUNTIME)
    parent = Parent(os.environ) if given.supervised else None
    with Interrupts() as interrupts:
        status = _route(given, interrupts, parent)
    exit_now(status)
    return status


def _route(given: argparse.Namespace, interrupts: Interrupts, parent: Parent | None) -> int:
    certificates = certificates_of()
    security = LinkSecurity(certificates, insecure=given.insecure, frames_stay=given.frames_stay)
    try:
        config = router_config(given.listen, given.connect, given.config, security)
        listen, connect = endpoints(config, "listen"), without_settings(endpoints(config, "connect"))
        for caution in cautions(listen, connect):
            log.warning("%s", caution)
        session = zenoh.open(config)
    except SecurityError as error:
        log.error("%s", error)
        return EXIT_CONFIG
    except Unreachable as error:
        log.error("%s", error)
        return EXIT_UNREACHABLE
    except zenoh.ZError as error:
        where = ", ".join(given.listen)
        log.error("cannot listen on %s: %s; is another router there? Choose --listen", where, first_line(error))
        return EXIT_UNREACHABLE
    log.info("listening on %s", ", ".join(given.listen) or "what its configuration says")
    _watch_links(session, listen, LinkWatch(connect, certificates), interrupts, parent)
    close(session)
    return 0


def _watch_links(
    session: zenoh.Session, listen: list[str], links: LinkWatch, interrupts: Interrupts, parent: Parent | None
) -> None:
    manager, limit, look_s, linked = Manager(os.environ), RateLimit(), 0.0, False
    settle()
    while not interrupts.requested():
        if parent is not None and parent.gone():
            log.error("the supervisor is gone; stopping")
            for endpoint in listen:
                remove_socket_folder(endpoint)
            return
        if time.monotonic() >= look_s:
            look_s = time.monotonic() + CHECK_S
            linked = bool(session.info.routers_zid())
            for level, text in links.turn(linked, time.monotonic(), time.time()):
                log.log(level, "%s", text)
        _tell_manager(manager, limit, "linked" if linked else "no link to another router")
        interrupts.wait(TURN_S)
    manager.leave()


def _tell_manager(manager: Manager, limit: RateLimit, status: str) -> None:
    try:
        manager.tell(time.monotonic(), status)
    except Unheard as error:
        if limit.allow("manager", time.monotonic()) is not None:
            log.warning("%s", error)


def _endpoints(value: object) -> list[str]:
    return [str(item) for item in value] if isinstance(value, list) else []


if __name__ == "__main__":
    raise SystemExit(main())
