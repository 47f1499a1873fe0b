"""`deixis poi`: look at the registry of points of interest and edit it, each edit acknowledged once it is on disk."""

from __future__ import annotations

import argparse
import getpass
import json
import re
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

from deixis_runtime.poi_files import load_pois
from deixis_runtime.session import open_client
from deixis_runtime.settings import checked_name
from deixis_runtime.site import SiteError
from deixis_schemas import codec, topics
from deixis_schemas.messages import Poi
from deixis_schemas.plain_text import shown, steers

from . import poi_edit
from .options import CommandError, add_connect, add_json, add_robot
from .poi_registry import EditRefused, PoiRegistry

MAX_BY = 128
# What msgpack needs besides a POI and its id.
PACKED_EXTRA = 16


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
    move = _action(actions, "move", "give one another position", run_move)
    _place(move)
    remove = _action(actions, "remove", "remove one", run_remove)
    remove.add_argument("poi_id", metavar="ID", type=checked_name)
    what = "add or replace those of a file: a site file, a YAML or JSON list, CSV, or GeoJSON in metres of the map"
    many = _action(actions, "import", what, run_import)
    many.add_argument("file", type=Path, metavar="FILE")
    page = actions.add_parser("edit", help="place them on the map in a page", description=poi_edit.__doc__)
    poi_edit.add_options(page)
    for edit in (add, move, remove, many, page):
        edit.add_argument("--by", type=_plain, default=who(), metavar="NAME", help="who edits (default: user@host)")


def run_list(given: argparse.Namespace) -> int:
    """Show all POIs."""
    with _registry(given) as registry:
        _show(registry.pois(), given)
    return 0


def run_add(given: argparse.Namespace) -> int:
    """Add or replace one POI."""
    poi = _checked(poi_id=given.poi_id, name=given.name, position_m=_position(given), extent_m=given.extent, tags=given.tag)
    with _registry(given) as registry:
        _show(_acknowledged(poi.poi_id, lambda: registry.put(poi)), given)
    return 0


def run_move(given: argparse.Namespace) -> int:
    """Give one POI another position."""
    with _registry(given) as registry:
        found = registry.pois(given.poi_id)
        if not found:
            raise CommandError(f"poi_id: there is no POI '{given.poi_id}'; use 'deixis poi add'")
        poi = _checked(**{**found[0].model_dump(), "position_m": _position(given)})
        _show(_acknowledged(poi.poi_id, lambda: registry.put(poi)), given)
    return 0


def run_remove(given: argparse.Namespace) -> int:
    """Remove one POI; shows it as it was."""
    with _registry(given) as registry:
        _show(_acknowledged(given.poi_id, lambda: registry.delete(given.poi_id)), given)
    return 0


def run_import(given: argparse.Namespace) -> int:
    """Add or replace the POIs of a file: all are checked before the first is sent."""
    try:
        pois = load_pois(given.file)
    except SiteError as error:
        raise CommandError(str(error)) from None
    if not pois:
        raise CommandError(f"{given.file}: holds no POIs")
    with _registry(given) as registry:
        stored: list[Poi] = []
        for part in _parts(pois):
            stored += _put_all(registry, part, len(stored))
        _show(stored, given)
    return 0


def _parts(pois: Sequence[Poi]) -> Iterator[dict[str, Any]]:
    """The POIs by id, as many at a time as one edit may hold."""
    part: dict[str, Any] = {}
    size = 0
    for poi in pois:
        content = poi.model_dump()
        packed = len(codec.encode(poi)) + len(poi.poi_id) + PACKED_EXTRA
        if part and size + packed > topics.POI.max_bytes:
            yield part
            part, size = {}, 0
        part[poi.poi_id] = content
        size += packed
    yield part


def _put_all(registry: PoiRegistry, pois: dict[str, Any], done: int) -> list[Poi]:
    """Put POIs as one edit; `done` of the file are stored. Raises CommandError."""
    try:
        return registry.put_all(pois)
    except EditRefused as error:
        before = f"{done} POIs are stored, none after them: " if done else ""
        raise CommandError(f"{before}{error}") from None


def _acknowledged(poi_id: str, edit: Callable[[], Poi]) -> list[Poi]:
    """What an edit of one POI stored. Raises CommandError, a refusal with the POI's id."""
    try:
        return [edit()]
    except EditRefused as error:
        raise CommandError(f"{poi_id}: {error}") from None


@contextmanager
def _registry(given: argparse.Namespace) -> Iterator[PoiRegistry]:
    with open_client(given.connect, shared_memory=False) as session:
        yield PoiRegistry(session, given.robot, given.connect, getattr(given, "by", ""))


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
        place = f"{x:8.2f} {y:8.2f} {z:8.2f} m  {poi.extent_m:5.2f} m"
        print(f"{poi.poi_id:<16} {place}  {_edited(poi):<40}  {poi.name}{tags}")


def _edited(poi: Poi) -> str:
    """When it was edited, in this host's time, and by whom."""
    if not poi.edited_ns:
        return poi.edited_by or "-"
    when = datetime.fromtimestamp(poi.edited_ns / 1e9).astimezone()
    return f"{when:%Y-%m-%d %H:%M} {poi.edited_by or 'unknown'}"


def who() -> str:
    """Who edits, if nothing else is said: user and host."""
    try:
        user = getpass.getuser()
    except (OSError, KeyError):  # a container's user without a name
        user = "unknown"
    return re.sub(r"[;&|=?#]", "-", f"{user}@{socket.gethostname()}")[:MAX_BY]


def _plain(text: str) -> str:
    """A name without what parts a selector's parameters, or steers a terminal."""
    if not text or len(text) > MAX_BY or any(mark in ";&|=?#" or steers(mark) for mark in text):
        raise argparse.ArgumentTypeError(
            f"'{shown(text[:80])}' is no name of up to {MAX_BY} plain characters without ; & | = ? #"
        )
    return text


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
