"""The registry of points of interest as those see it who edit it: each edit is answered once it is on disk, or refused."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import zenoh
from deixis_runtime.certificate_check import who_may_not_edit
from deixis_runtime.certificates import certificates_of
from deixis_schemas import codec, topics
from deixis_schemas.messages import Poi

from .gets import get_all, get_pois
from .options import CommandError

DEADLINE_S = 5.0
PAUSE_S = 0.1


class EditRefused(CommandError):
    """An edit that fusion refuses; the text names the field."""


class NoAnswer(CommandError):
    """Fusion does not answer; the text names robot and endpoint, and the certificate where that is the cause."""


@dataclass(frozen=True)
class PoiRegistry:
    """A robot's registry by way of a session with the router at `connect`; `by` is who edits."""

    session: zenoh.Session
    robot: str
    connect: str
    by: str = ""

    def pois(self, which: str = "**") -> list[Poi]:
        """All POIs by id, or the one of this id. Raises NoAnswer."""
        deadline_s = time.monotonic() + DEADLINE_S
        while (found := get_pois(self.session, self.robot, which)) is None:
            if time.monotonic() > deadline_s:
                raise self._nobody()
            time.sleep(PAUSE_S)
        return found

    def put(self, poi: Poi) -> Poi:
        """Add or replace a POI; the stored one. Raises EditRefused, NoAnswer."""
        return self._edited(f"{topics.POI.key(self.robot, id=poi.poi_id)}?op=put;by={self.by}", codec.encode(poi))[0]

    def delete(self, poi_id: str) -> Poi:
        """Remove a POI; it as it was. Raises EditRefused, NoAnswer."""
        return self._edited(f"{topics.POI.key(self.robot, id=poi_id)}?op=delete;by={self.by}", None)[0]

    def put_all(self, pois: dict[str, Any]) -> list[Poi]:
        """Put POIs, by id, as one edit, of which all are stored or none. Raises EditRefused, NoAnswer."""
        return self._edited(f"{topics.POI.key(self.robot, id='*')}?op=put_all;by={self.by}", codec.pack(pois))

    def _edited(self, selector: str, payload: bytes | None) -> list[Poi]:
        encoding = codec.encoding_of(Poi) if payload is not None else None
        deadline_s = time.monotonic() + DEADLINE_S
        while True:
            stored, refused = get_all(self.session, selector, Poi, payload=payload, encoding=encoding, timeout_s=DEADLINE_S)
            if refused:
                raise EditRefused(refused[0].reason)
            if stored:
                return [poi for _, poi in stored]
            # A get made just as fusion comes up or restarts comes back empty.
            if time.monotonic() > deadline_s:
                raise self._nobody()
            time.sleep(PAUSE_S)

    def _nobody(self) -> NoAnswer:
        silent = f"fusion of robot '{self.robot}' does not answer at {self.connect}"
        # Access control denies without a word.
        ours = who_may_not_edit(certificates_of())
        if ours is not None:
            return NoAnswer(f"{silent}: the certificate {ours} is not an editor's")
        return NoAnswer(f"{silent}; 'deixis doctor' tells why")
