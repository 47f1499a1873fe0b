"""`deixis poi edit`: a page on which points of interest are placed by clicking on the map, each edit acknowledged.

It is served to browsers of this host alone; its address holds a word that nobody else knows. Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
import ipaddress
import secrets
import socket
import sys
import webbrowser
from pathlib import Path

from deixis_runtime.certificate_check import who_may_not_edit
from deixis_runtime.certificates import certificates_of
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import open_client

from .options import CommandError, add_connect, add_robot, read_site
from .poi_link import PoiLink
from .poi_map import SiteMap, site_map
from .poi_registry import PoiRegistry

LOOK_EVERY_S = 0.4


def add_options(parser: argparse.ArgumentParser) -> None:
    """What the command is told, but for who edits."""
    add_robot(parser)
    add_connect(parser)
    parser.add_argument("--site", type=Path, metavar="FILE", help="site file: its map, its walls and where the robot begins")
    parser.add_argument("--port", type=_port, default=0, metavar="N", help="where the page is served (default: any free port)")
    parser.add_argument(
        "--listen", type=_address, default="127.0.0.1", metavar="ADDRESS", help="by which address (default: %(default)s)"
    )
    parser.add_argument("--insecure", action="store_true", help="serve the page to the network, without TLS, all the same")
    parser.add_argument("--open", action="store_true", help="open it in this host's browser")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Serve the page until interrupted: then 0. Raises CommandError, or Unreachable without a router."""
    if not ipaddress.ip_address(given.listen).is_loopback and not given.insecure:
        port = given.port or 8080
        raise CommandError(
            f"--listen {given.listen}: whoever reads the network there could edit points of interest, for the page has no TLS; "
            f"say --insecure to serve it all the same, or reach it by 'ssh -L {port}:127.0.0.1:{port}'"
        )
    ours = who_may_not_edit(certificates_of())
    if ours is not None:
        raise CommandError(f"the certificate {ours} is not an editor's: ask for one of role 'editor'")
    drawn = site_map(read_site(given.site))
    with Interrupts() as interrupts, open_client(given.connect, shared_memory=False) as session:
        _serve(given, drawn, PoiLink(PoiRegistry(session, given.robot, given.connect, given.by)), interrupts)
    return 0


def _serve(given: argparse.Namespace, drawn: SiteMap, link: PoiLink, interrupts: Interrupts) -> None:
    # Here, for 'deixis poi list' needs no HTTP server and would wait for its import.
    from .poi_requests import Page  # noqa: PLC0415
    from .poi_server import PageServer, host_names, page_files, serving  # noqa: PLC0415

    try:
        server = PageServer(given.listen, given.port)
    except OSError as error:
        raise CommandError(f"--listen {given.listen} --port {given.port}: {error.strerror or error}") from None
    token = secrets.token_urlsafe(24)
    hosts = host_names(given.listen, server.port)
    link.look()
    server.page = Page(token, hosts, given.robot, given.by, drawn, link, page_files())
    with serving(server):
        # Behind the number sign: a browser sends that part to nobody.
        address = f"http://{_shown_host(given.listen)}:{server.port}/#token={token}"
        print(f"{address}\nplace points of interest of robot '{given.robot}' there; Ctrl-C ends it", flush=True)
        if given.open and not webbrowser.open(address):
            print("deixis poi edit: no browser is found on this host; open the address by hand", file=sys.stderr)
        _look_on(link, interrupts)


def _look_on(link: PoiLink, interrupts: Interrupts) -> None:
    trouble = ""
    while not interrupts.wait(LOOK_EVERY_S):
        link.look()
        now = link.snapshot().trouble
        if now != trouble:
            print(f"deixis poi edit: {now or 'fusion answers again'}", file=sys.stderr, flush=True)
            trouble = now


def _shown_host(address: str) -> str:
    """The host's part of an address that others can open: of one that stands for all addresses, this host's name."""
    where = ipaddress.ip_address(address)
    if where.is_unspecified:
        return socket.gethostname().lower()
    return f"[{address}]" if where.version == 6 else address


def _port(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port from 0 to 65535")
    return int(text)


def _address(text: str) -> str:
    try:
        return str(ipaddress.ip_address({"localhost": "127.0.0.1"}.get(text, text)))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no IP address of this host, as 127.0.0.1") from None
