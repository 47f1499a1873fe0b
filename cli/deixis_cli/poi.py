"""`deixis poi`: look at the registry of points of interest and edit it, each edit acknowledged once it is on disk."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import zenoh
from deixis_runtime.session import open_client
from deixis_runtime.settings import checked_name
from deixis_runtime.site import SiteError, load_pois
from deixis_schemas import codec, topics
from deixis_schemas.messages import Poi

from .gets import get_all, get_pois
from .options import CommandError, add_connect, add_json, add_robot

DEADLINE_S = 5.0
PAUSE_S = 0.1


def register(subparsers: Any) -> None:
    """Add the command with its own subcommands."""
    parser = subparsers.add_parser("poi", help="the registry of points of interest", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    _action(actions, "list", "show all", run_list)
    add = _action(actions, "add", "add one, or replace the one of this id", run_add)
    _place(add)
    add.add_argument("--name", default="", help="for people")
    add.add_argument("--extent", type=float, default=0.5, metavar="METRES", help="size across (default: %(default)s)")
    add.add_argument("--tag", action="append", default=[], help="may be given again")
    _place(_action(actions, "move", "give one another position", run_move))
    _action(actions, "remove", "remove one", run_remove).add_argument("poi_id", metavar="ID", type=checked_name)
    many = _action(actions, "import", "add or replace those of a site file, or of a YAML or JSON list", run_import)
    many.add_argument("file", type=Path, metavar="FILE")


def run_list(given: argparse.Namespace) -> int:
    """Show all POIs."""
    with open_client(given.connect, shared_memory=False) as session:
        _show(_pois(session, given), given)
    return 0


def run_add(given: argparse.Namespace) -> int:
    """Add or replace one POI."""
    poi = _checked(poi_id=given.poi_id, name=given.name, position_m=_position(given), extent_m=given.extent, tags=given.tag)
    with open_client(given.connect, shared_memory=False) as session:
        _show([_edit(session, given, poi.poi_id, poi)], given)
    return 0


def run_move(given: argparse.Namespace) -> int:
    """Give one POI another position."""
    with open_client(given.connect, shared_memory=False) as session:
        found = _pois(session, given, given.poi_id)
        if not found:
            raise CommandError(f"poi_id: there is no POI '{given.poi_id}'; use 'deixis poi add'")
        poi = _checked(**{**found[0].model_dump(), "position_m": _position(given)})
        _show([_edit(session, given, poi.poi_id, poi)], given)
    return 0


def run_remove(given: argparse.Namespace) -> int:
    """Remove one POI; shows it as it was."""
    with open_client(given.connect, shared_memory=False) as session:
        _show([_edit(session, given, given.poi_id, None)], given)
    return 0


def run_import(given: argparse.Namespace) -> int:
    """Add or replace the POIs of a file: all are checked before the first is sent."""
    try:
        pois = load_pois(given.file)
    except SiteError as error:
        raise CommandError(str(error)) from None
    if not pois:
        raise CommandError(f"{given.file}: holds no POIs")
    with open_client(given.connect, shared_memory=False) as session:
        _show([_edit(session, given, poi.poi_id, Poi.model_validate(poi.model_dump())) for poi in pois], given)
    return 0


def _edit(session: zenoh.Session, given: argparse.Namespace, which: str, poi: Poi | None) -> Poi:
    """Put a POI, or delete it where `poi` is none, and wait for the stored one. Raises CommandError."""
    selector = f"{topics.POI.key(given.robot, id=which)}?op={'delete' if poi is None else 'put'}"
    payload = codec.encode(poi) if poi is not None else None
    encoding = codec.encoding_of(Poi) if poi is not None else None
    deadline_s = time.monotonic() + DEADLINE_S
    while True:
        stored, refused = get_all(session, selector, Poi, payload=payload, encoding=encoding)
        if refused:
            raise CommandError(f"{which}: {refused[0].reason}")
        if stored:
            return stored[0][1]
        # A get made just as fusion comes up or restarts comes back empty.
        if time.monotonic() > deadline_s:
            raise CommandError(_nobody(given))
        time.sleep(PAUSE_S)


def _pois(session: zenoh.Session, given: argparse.Namespace, which: str = "**") -> list[Poi]:
    """All POIs, or the one of this id. Raises CommandError where fusion does not answer."""
    deadline_s = time.monotonic() + DEADLINE_S
    while (found := get_pois(session, given.robot, which)) is None:
        if time.monotonic() > deadline_s:
            raise CommandError(_nobody(given))
        time.sleep(PAUSE_S)
    return found


def _nobody(given: argparse.Namespace) -> str:
    return f"fusion of robot '{given.robot}' does not answer at {given.connect}; 'deixis doctor' tells why"


def _checked(**content: Any) -> Poi:
    try:
        return codec.validate(Poi, content)
    except codec.CodecError as error:
        raise CommandError(str(error)) from None


def _show(pois: list[Poi], given: argparse.Namespace) -> None:
    if given.json:
        print(json.dumps([poi.model_dump(mode="json") for poi in pois]))
        return
    for poi in pois:
        x, y, z = poi.position_m
        tags = f"  [{', '.join(poi.tags)}]" if poi.tags else ""
        print(f"{poi.poi_id:<16} {x:8.2f} {y:8.2f} {z:8.2f} m  {poi.extent_m:5.2f} m  {poi.name}{tags}")


def _action(actions: Any, name: str, text: str, run: Any) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = actions.add_parser(name, help=text, description=text)
    add_robot(parser)
    add_connect(parser)
    add_json(parser, "print a JSON list of the POIs shown")
    parser.set_defaults(run=run)
    return parser


def _position(given: argparse.Namespace) -> tuple[float, float, float]:
    return given.x_m, given.y_m, given.z_m


def _place(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("poi_id", metavar="ID", type=checked_name)
    for axis in ("x_m", "y_m", "z_m"):
        parser.add_argument(axis, type=float, metavar=axis[0].upper(), help="in the map frame, metres")
