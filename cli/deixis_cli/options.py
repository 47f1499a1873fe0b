"""Options that several commands share, and what is read from them."""

from __future__ import annotations

import argparse
import logging
import math
from pathlib import Path

from deixis_runtime.certificates import add_certificates, certificates_of
from deixis_runtime.endpoint import NotAnEndpoint, read_endpoint
from deixis_runtime.host import SOURCE, HostOptions, chosen_stages, known_stages
from deixis_runtime.lineups import CLASSIC, LINEUPS, LineupError, guests_of
from deixis_runtime.link_security import LinkSecurity
from deixis_runtime.session import DEFAULT_ENDPOINT
from deixis_runtime.settings import checked_name
from deixis_runtime.site import Site, SiteError, load_site
from deixis_schemas import topics

log = logging.getLogger("deixis")

DEMO_ROBOT = "demo"


class CommandError(Exception):
    """A command that cannot do its job; the text says why."""


def add_robot(parser: argparse.ArgumentParser, default: str | None = None, *, required: bool = True) -> None:
    """--robot; required where there is no default: two robots must never cross-talk by accident."""
    shown = f"name of the robot, the second part of every key{f' (default: {default})' if default else ''}"
    parser.add_argument(
        "--robot", required=required and default is None, default=default, type=checked_name, metavar="NAME", help=shown
    )


def add_connect(parser: argparse.ArgumentParser) -> None:
    """--connect of a command that asks a running system."""
    parser.add_argument(
        "--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT", help="Zenoh router of the system (default: %(default)s)"
    )
    add_certificates(parser)


def add_json(parser: argparse.ArgumentParser, what: str) -> None:
    """--json."""
    parser.add_argument("--json", action="store_true", help=what)


def seconds(text: str) -> float:
    """A time to wait, for argparse. Raises ArgumentTypeError for what is none."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is no number of seconds above 0")
    return value


def add_host(parser: argparse.ArgumentParser) -> None:
    """What a command that starts stages needs to know."""
    parser.add_argument("--site", type=Path, metavar="FILE", help="site file: camera, walls, points of interest, settings")
    parser.add_argument(
        "--listen",
        action="append",
        metavar="ENDPOINT",
        help=f"where others reach this host's router; may be given again (default: {DEFAULT_ENDPOINT})",
    )
    add_certificates(parser)
    parser.add_argument("--insecure", action="store_true", help="listen on the network without TLS all the same")
    parser.add_argument("--frames-stay", action="store_true", help="let no frame leave this host (pictures of people)")
    parser.add_argument("--only", action="append", default=[], metavar="STAGES", help="start these stages only, e.g. camera")
    parser.add_argument("--except", action="append", default=[], dest="without", metavar="STAGES", help="start all but these")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="sets",
        metavar="STAGE.NAME=VALUE",
        help="override a setting, e.g. camera.encoding=jpeg; may be given again",
    )
    add_lineup(parser)
    parser.add_argument("--registry", type=Path, metavar="FILE", help="SQLite file of the points of interest")
    parser.add_argument(
        "--no-fork",
        action="store_true",
        help="start each process from nothing, not forked from one that has done the imports: more memory, slower",
    )


def add_lineup(parser: argparse.ArgumentParser) -> None:
    """--lineup."""
    parser.add_argument(
        "--lineup",
        default=CLASSIC,
        metavar="NAME",
        help=f"guests in the place of stages ('make guests' installs them): {', '.join(LINEUPS)} (default: %(default)s)",
    )


def read_lineup(name: str) -> dict[str, str]:
    """The guests of a line-up, by stage. Raises CommandError."""
    try:
        return guests_of(name)
    except LineupError as error:
        raise CommandError(str(error)) from None


def host_options(given: argparse.Namespace, source: dict[str, str] | None = None, **others: object) -> HostOptions:
    """The host's options from what `add_host` reads; `source` holds settings of the stage that plays it.

    Raises CommandError or HostFailed.
    """
    stages = chosen_stages(_names(given.only), _names(given.without))
    absent = set(topics.STAGES) - {*stages, *_names(given.without)}
    if absent and not given.only:
        log.warning("not installed here and so not started: %s", ", ".join(sorted(absent)))
    sets = stage_settings(given.sets)
    # Ahead of --set, which so may override them.
    ours = [f"{name}={value}" for name, value in (source or {}).items()]
    sets[SOURCE] = (*ours, *sets.get(SOURCE, ()))
    if given.registry is not None:
        keeper = topics.POI.stage
        if keeper not in stages:
            raise CommandError(f"--registry is for {keeper}, which is not started here")
        sets[keeper] = (f"registry={quoted(str(given.registry.resolve()))}", *sets.get(keeper, ()))
    for stage in sets:
        if sets[stage] and stage not in stages:
            raise CommandError(f"a setting is given for stage '{stage}', which is not started here")
    site = given.site.resolve() if given.site is not None else None
    listen = tuple(given.listen or (DEFAULT_ENDPOINT,))
    for endpoint in listen:
        try:
            read_endpoint(endpoint, least_port=0)
        except NotAnEndpoint as error:
            raise CommandError(f"--listen: {error}") from None
    security = LinkSecurity(certificates_of(), insecure=given.insecure, frames_stay=given.frames_stay)
    return HostOptions(
        robot=given.robot,
        stages=stages,
        site=site,
        listen=listen,
        sets=sets,
        security=security,
        fork=not given.no_fork,
        guests={stage: guest for stage, guest in read_lineup(given.lineup).items() if stage in stages},
        **others,  # type: ignore[arg-type]
    )


def stage_settings(items: list[str]) -> dict[str, tuple[str, ...]]:
    """`STAGE.NAME=VALUE` by stage. Raises CommandError."""
    found: dict[str, tuple[str, ...]] = {}
    for item in items:
        name, equals, value = item.partition("=")
        stage, dot, field = name.partition(".")
        if not (equals and dot and stage and field):
            raise CommandError(f"--set {item}: not of the form STAGE.NAME=VALUE, e.g. camera.encoding=jpeg")
        found[stage] = (*found.get(stage, ()), f"{field}={value}")
    return found


def read_site(path: Path | None) -> Site | None:
    """The site file, checked before anything starts. Raises CommandError."""
    if path is None:
        return None
    try:
        site = load_site(path)
    except SiteError as error:
        raise CommandError(str(error)) from None
    known = known_stages()
    for stage in site.settings:
        if stage not in known:
            raise CommandError(f"site file {path}: settings.{stage}: there is no such stage ({', '.join(known)})")
    return site


def quoted(text: str) -> str:
    """The text as a YAML string, whatever it holds."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _names(items: list[str]) -> tuple[str, ...]:
    return tuple(name.strip() for item in items for name in item.split(",") if name.strip())
