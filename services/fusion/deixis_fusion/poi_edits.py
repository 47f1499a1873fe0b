"""Answers gets and takes edits on `fusion/poi/**`."""

from __future__ import annotations

from collections import deque

from deixis_runtime.queries import Edit, Query, Refused
from deixis_schemas.messages import Message, Poi, RejectedEdit

from .edits import EditError, matches, poi_id_of, read_poi
from .registry import Registry, RegistryError

KEPT_REJECTIONS = 16
OPERATIONS = ("put", "delete")


class PoiEdits:
    """The registry as seen from its keys: reads, acknowledged edits, and edits without an answer."""

    def __init__(self, registry: Registry, prefix: str) -> None:
        """`prefix` is the key of the POIs up to their id, e.g. `deixis/r1/fusion/poi/`."""
        self._registry = registry
        self._prefix = prefix
        self.accepted = 0
        self.rejected = 0
        self.rejections: deque[RejectedEdit] = deque(maxlen=KEPT_REJECTIONS)

    def take(self, edit: Edit, now_ns: int) -> str | None:
        """Do an edit that nobody waits for. Returns why it was refused, or none when it is on disk."""
        try:
            self._edit(edit.kind, edit.key, edit.payload, edit.encoding)
        except (EditError, RegistryError) as error:
            self._reject(edit.key, str(error), now_ns)
            return str(error)
        return None

    def answer(self, query: Query, now_ns: int) -> list[tuple[str, Message]]:
        """Answer a get: the matching POIs each under its own key or, with a payload or `op`, an edit's stored POI.

        A deleted POI is answered as it was. Raises Refused with the field's name.
        """
        operation = query.parameters.get("op", "put" if query.payload else "")
        if not operation:
            return [(key, poi) for poi in self._registry.pois() if matches(query.key, key := self._prefix + poi.poi_id)]
        if operation not in OPERATIONS:
            raise Refused(f"op: '{operation[:40]}' is neither 'put' nor 'delete'")
        try:
            return [(query.key, self._edit(operation, query.key, query.payload or b"", query.encoding))]
        except (EditError, RegistryError) as error:
            self._reject(query.key, str(error), now_ns)
            raise Refused(str(error)) from None

    def _edit(self, operation: str, key: str, payload: bytes, encoding: str) -> Poi:
        if operation == "delete":
            poi = self._registry.delete(poi_id_of(key))
        else:
            poi = read_poi(key, payload, encoding)
            self._registry.put(poi)
        self.accepted += 1
        return poi

    def _reject(self, key: str, reason: str, now_ns: int) -> None:
        self.rejected += 1
        self.rejections.append(RejectedEdit(key=key[:2000], reason=reason[:2000], stamp_ns=now_ns))
