"""POIs as seen from their keys `fusion/poi/{id}`: gets, acknowledged edits, and puts and deletes that nobody waits for."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from deixis_runtime.queries import Edit, Query, Refused, check_names, key_matches
from deixis_schemas.codec import MSGPACK, CodecError, Malformed, WrongType, WrongVersion, parse_json, unpack, validate
from deixis_schemas.messages import MAX_TEXT, Message, Poi, RejectedEdit
from deixis_schemas.plain_text import plain, shown

from .registry import Change, Delete, Put, Registry, RegistryError

KEPT_REJECTIONS = 16
OPERATIONS = ("put", "delete", "put_all")
PARAMETERS = ("op", "by")
MAX_BY = 128
MAX_BYTES = 64 << 10
# What generic Zenoh clients send: JSON under its own label, as text, or without any.
JSON_LABELS = ("", "application/json", "text/json", "text/plain", "zenoh/string", "zenoh/bytes")


class EditError(ValueError):
    """An edit that is refused; the text begins with the field's name."""


class PoiEdits:
    """Reads the registry and edits it; counts, and keeps the last refusals."""

    def __init__(self, registry: Registry, prefix: str, announce: Callable[[str, Poi | None], None]) -> None:
        """`prefix` is the key of the POIs up to their id, e.g. `deixis/r1/fusion/poi/`.

        `announce` tells those who watch the keys of an acknowledged edit: of the POI by its id, none where it was deleted. The
        other edits they have heard themselves.
        """
        self._registry = registry
        self._prefix = prefix
        self._announce = announce
        self.accepted = 0
        self.rejected = 0
        self.rejections: deque[RejectedEdit] = deque(maxlen=KEPT_REJECTIONS)

    def take(self, edits: Sequence[Edit], now_ns: int) -> list[str]:
        """Do edits that nobody waits for, in one transaction. Returns key and cause of those that were refused."""
        keys, changes, refused = [], [], []
        for edit in edits:
            try:
                change = self._change(edit.kind, edit.key, edit.payload, edit.encoding, now_ns)
            except EditError as error:
                refused.append(f"{edit.key[:200]}: {self._reject(edit.key, str(error), now_ns)}")
            else:
                keys.append(edit.key)
                changes.append(change)
        for key, result in zip(keys, self._registry.apply(changes), strict=True):
            if isinstance(result, RegistryError):
                refused.append(f"{key[:200]}: {self._reject(key, str(result), now_ns)}")
            else:
                self.accepted += 1
        return refused

    def answer(self, query: Query, now_ns: int) -> list[tuple[str, Message]]:
        """Answer a get: the matching POIs each under its own key or, with a payload or `op`, an edit's stored POIs.

        A deleted POI is answered as it was. `by` says who edits. Raises Refused with the field's name.
        """
        check_names(query.parameters, PARAMETERS)
        operation = query.parameters.get("op", "put" if query.payload else "")
        if not operation:
            keys = ((self._prefix + poi.poi_id, poi) for poi in self._registry.pois())
            return [(key, poi) for key, poi in keys if key_matches(query.key, key)]
        if operation not in OPERATIONS:
            raise Refused(f"op: '{shown(operation[:40])}' is none of {', '.join(OPERATIONS)}")
        try:
            changes = self._changes(operation, query, now_ns)
            results = self._registry.apply(changes, all_or_none=True)
        except (EditError, RegistryError) as error:
            raise Refused(self._reject(query.key, str(error), now_ns)) from None
        stored = [result for result in results if isinstance(result, Poi)]
        self.accepted += len(stored)
        for poi in stored:
            self._announce(poi.poi_id, None if operation == "delete" else poi)
        return [(self._prefix + poi.poi_id, poi) for poi in stored]

    def _changes(self, operation: str, query: Query, now_ns: int) -> list[Change]:
        try:
            by = plain(query.parameters.get("by", "")[:MAX_BY])
        except ValueError as error:
            raise EditError(f"by: {error}") from None
        if operation == "put_all":
            return [Put(poi) for poi in self._many(query, by, now_ns)]
        return [self._change(operation, query.key, query.payload or b"", query.encoding, now_ns, by)]

    def _many(self, query: Query, by: str, now_ns: int) -> list[Poi]:
        """The POIs of a payload by their ids. Raises EditError that names POI and field."""
        if query.key != f"{self._prefix}*":
            raise EditError(f"key: '{shown(query.key[:200])}' is not '{self._prefix}*', the key of all POIs")
        content = _content(query.payload or b"", query.encoding)
        return [_stamped(_poi_of(poi_id, fields), by, now_ns) for poi_id, fields in content.items()]

    def _change(self, operation: str, key: str, payload: bytes, encoding: str, now_ns: int, by: str = "") -> Change:
        poi_id = poi_id_of(self._prefix, key)
        return Delete(poi_id) if operation == "delete" else Put(_stamped(read_poi(poi_id, payload, encoding), by, now_ns))

    def _reject(self, key: str, reason: str, now_ns: int) -> str:
        self.rejected += 1
        self.rejections.append(RejectedEdit(key=key[:MAX_TEXT], reason=reason[:MAX_TEXT], stamp_ns=now_ns))
        return reason


def poi_id_of(prefix: str, key: str) -> str:
    """The id that is all there is after the prefix. Raises EditError where the key names no single POI."""
    poi_id = key.removeprefix(prefix)
    if not key.startswith(prefix) or not poi_id or any(mark in poi_id for mark in "/*$"):
        raise EditError(f"key: '{shown(key[:200])}' names no single POI")
    return poi_id


def read_poi(poi_id: str, payload: bytes, encoding: str) -> Poi:
    """The POI that an edit puts under the key of `poi_id`, which is taken from there where it is absent.

    Raises EditError.
    """
    try:
        content = _content(payload, encoding)
        poi = validate(Poi, {"poi_id": poi_id} | content)
    except CodecError as error:
        raise EditError(str(error)) from None
    if poi.poi_id != poi_id:
        raise EditError(f"poi_id: '{poi.poi_id}', but the key ends in '{poi_id}'")
    return poi


def _stamped(poi: Poi, by: str, now_ns: int) -> Poi:
    """The POI with who and when: what the asker says of the time does not count."""
    return poi.model_copy(update={"edited_by": by or poi.edited_by, "edited_ns": now_ns})


def _poi_of(poi_id: str, fields: object) -> Poi:
    if not isinstance(fields, dict):
        raise EditError(f"{shown(poi_id[:80])}: not an object but {type(fields).__name__}")
    try:
        poi = validate(Poi, {"poi_id": poi_id} | fields)
    except CodecError as error:
        raise EditError(f"{shown(poi_id[:80])}: {error}") from None
    if poi.poi_id != poi_id:
        raise EditError(f"poi_id: '{poi.poi_id}', but it stands under '{shown(poi_id[:80])}'")
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
