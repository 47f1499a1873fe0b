"""Edits of the registry as they arrive under `fusion/poi/{id}`: read, checked, and refused with the field's name."""

from __future__ import annotations

from typing import Any

from deixis_schemas.codec import MSGPACK, CodecError, Malformed, WrongType, WrongVersion, parse_json, unpack, validate
from deixis_schemas.messages import Poi

MAX_BYTES = 64 << 10
# What generic Zenoh clients send: JSON under its own label, as text, or without any.
JSON_LABELS = ("", "application/json", "text/json", "text/plain", "zenoh/string", "zenoh/bytes")


class EditError(ValueError):
    """An edit that is refused; the text begins with the field's name."""


def poi_id_of(key: str) -> str:
    """The id in a key that ends in `fusion/poi/{id}`. Raises EditError where the key names no single POI."""
    head, _, poi_id = key.rpartition("/")
    if not head.endswith("fusion/poi") or not poi_id or "*" in poi_id or "$" in poi_id:
        raise EditError(f"key: '{key}' names no single POI")
    return poi_id


def read_poi(key: str, payload: bytes, encoding: str) -> Poi:
    """The POI that an edit puts under `key`; its `poi_id` is taken from the key where it is absent.

    Raises EditError.
    """
    poi_id = poi_id_of(key)
    try:
        content = _content(payload, encoding)
        poi = validate(Poi, {"poi_id": poi_id} | content)
    except CodecError as error:
        raise EditError(str(error)) from None
    if poi.poi_id != poi_id:
        raise EditError(f"poi_id: '{poi.poi_id}', but the key ends in '{poi_id}'")
    return poi


def _content(payload: bytes, encoding: str) -> dict[str, Any]:
    base, _, schema = encoding.partition(";")
    if base == MSGPACK:
        _check_schema(schema)
    elif base not in JSON_LABELS:
        raise WrongType(f"encoding: '{encoding[:80]}' is neither {MSGPACK};Poi/{Poi.VERSION} nor application/json")
    read = unpack if base == MSGPACK else parse_json
    try:
        return read(payload, max_bytes=MAX_BYTES)
    except Malformed as error:
        raise EditError(f"payload: {error}") from None


def _check_schema(schema: str) -> None:
    name, _, version = schema.partition("/")
    if name != "Poi":
        raise WrongType(f"encoding: '{schema[:80]}', expected 'Poi/{Poi.VERSION}'")
    if version != str(Poi.VERSION):
        raise WrongVersion(f"encoding: Poi version '{version[:20]}', this reader speaks {Poi.VERSION}")


def matches(expression: str, key: str) -> bool:
    """Whether a Zenoh key expression (`*` one part, `**` any number, `$*` any text in a part) takes in a concrete key."""
    return _match(expression.split("/"), key.split("/"))


def _match(pattern: list[str], parts: list[str]) -> bool:
    if not pattern:
        return not parts
    if pattern[0] == "**":
        return _match(pattern[1:], parts) or (bool(parts) and not parts[0].startswith("@") and _match(pattern, parts[1:]))
    return bool(parts) and _match_part(pattern[0], parts[0]) and _match(pattern[1:], parts[1:])


def _match_part(pattern: str, part: str) -> bool:
    if pattern == "*":
        return not part.startswith("@")
    pieces = pattern.split("$*")
    if len(pieces) == 1:
        return pattern == part
    if len(part) < len(pieces[0]) + len(pieces[-1]) or not part.startswith(pieces[0]) or not part.endswith(pieces[-1]):
        return False
    at = len(pieces[0])
    for piece in pieces[1:-1]:
        found = part.find(piece, at)
        if found < 0:
            return False
        at = found + len(piece)
    return at <= len(part) - len(pieces[-1])
