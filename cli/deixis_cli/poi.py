"""`deixis poi`: look at the registry of points of interest and edit it, each edit acknowledged once it is on disk."""

from __future__ import annotations

import argparse
import getpass
import json
import re
import socket
import time
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import zenoh
from deixis_runtime.certificate_check import who_may_not_edit
from deixis_runtime.certificates import certificates_of
from deixis_runtime.poi_files import load_pois
from deixis_runtime.session import open_client
from deixis_runtime.settings import checked_name
from deixis_runtime.site import SiteError
from deixis_schemas import codec, topics
from deixis_schemas.messages import Poi
from deixis_schemas.plain_text import shown, steers

from .gets import get_all, get_pois
from .options import CommandError, add_connect, add_json, add_robot

DEADLINE_S = 5.0
PAUSE_S = 0.1
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
    for edit in (add, move, remove, many):
        edit.add_argument("--by", type=_plain, default=who(), metavar="NAME", help="who edits (default: %(default)s)")


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
        stored: list[Poi] = []
        for part in _parts(pois):
            stored += _put_all(session, given, part, len(stored))
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


def _put_all(session: zenoh.Session, given: argparse.Namespace, pois: dict[str, Any], done: int) -> list[Poi]:
    """Put POIs as one edit, of which all are stored or none; `done` of the file are. Raises CommandError."""
    selector = f"{topics.POI.key(given.robot, id='*')}?op=put_all;by={given.by}"
    payload = codec.pack(pois)
    stored, refused = _answered(session, given, selector, payload)
    if refused:
        before = f"{done} POIs are stored, none after them: " if done else ""
        raise CommandError(f"{before}{refused}")
    return stored


def _edit(session: zenoh.Session, given: argparse.Namespace, which: str, poi: Poi | None) -> Poi:
    """Put a POI, or delete it where `poi` is none, and wait for the stored one. Raises CommandError."""
    selector = f"{topics.POI.key(given.robot, id=which)}?op={'delete' if poi is None else 'put'};by={given.by}"
    stored, refused = _answered(session, given, selector, codec.encode(poi) if poi is not None else None)
    if refused:
        raise CommandError(f"{which}: {refused}")
    return stored[0]


def _answered(
    session: zenoh.Session, given: argparse.Namespace, selector: str, payload: bytes | None
) -> tuple[list[Poi], str | None]:
    """What an edit stored, or why it is refused. Raises CommandError where fusion does not answer."""
    encoding = codec.encoding_of(Poi) if payload is not None else None
    deadline_s = time.monotonic() + DEADLINE_S
    while True:
        stored, refused = get_all(session, selector, Poi, payload=payload, encoding=encoding, timeout_s=DEADLINE_S)
        if refused:
            return [], refused[0].reason
        if stored:
            return [poi for _, poi in stored], None
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
    # Access control denies without a word.
    ours = who_may_not_edit(certificates_of())
    if ours is not None:
        return f"fusion of robot '{given.robot}' does not answer at {given.connect}: the certificate {ours} is not an editor's"
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
