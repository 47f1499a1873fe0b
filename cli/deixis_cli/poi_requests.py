"""Requests of the page of `deixis poi edit`, answered: who may ask, what is read, and what an edit came to.

Pure: a request's parts in, an answer's out. A page of another site that the browser shows as well can send requests here, but
neither knows the token nor may set a header of its own; and a name that is led to this address by its DNS is not in `hosts`.
"""

from __future__ import annotations

import hmac
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from deixis_schemas import codec
from deixis_schemas.messages import NAME_PATTERN, Poi

from .poi_link import PoiStore
from .poi_map import SiteMap
from .poi_registry import EditRefused, NoAnswer

MAX_BODY_BYTES = 64 << 10
TOKEN_HEADER = "x-deixis-token"
JSON = "application/json"
EDITABLE = frozenset({"poi_id", "name", "position_m", "extent_m", "tags"})
FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/view.js": ("view.js", "text/javascript; charset=utf-8"),
}
POIS = "/api/pois/"


@dataclass(frozen=True)
class Request:
    """An HTTP request; names of headers in small letters. The body is read up to `MAX_BODY_BYTES` and one more."""

    method: str
    target: str
    headers: Mapping[str, str]
    body: bytes = b""


@dataclass(frozen=True)
class Response:
    """Status, type and bytes of an answer."""

    status: int
    content_type: str
    body: bytes


@dataclass(frozen=True)
class Page:
    """Answers the requests of one page.

    token: who does not know it is refused. hosts: what `Host` may say, in small letters. files: the page's own, by name.
    """

    token: str
    hosts: frozenset[str]
    robot: str
    by: str
    site: SiteMap
    store: PoiStore
    files: Mapping[str, bytes] = field(default_factory=dict)

    def answer(self, request: Request) -> Response:
        """The answer to a request, whatever it is."""
        try:
            return self._answer(request)
        except _Refused as refused:
            return refused.response

    def _answer(self, request: Request) -> Response:
        self._check_sender(request)
        url = urlsplit(request.target)
        if request.method == "GET" and url.path in FILES:
            name, content_type = FILES[url.path]
            return Response(200, content_type, self.files[name])
        if not url.path.startswith("/api/"):
            raise _Refused(404, "there is no such page here")
        if not hmac.compare_digest(request.headers.get(TOKEN_HEADER, "").encode(), self.token.encode()):
            raise _Refused(403, "token: wrong; open the address that 'deixis poi edit' printed last")
        if request.method == "GET":
            return self._show(url.path, url.query)
        if url.path.startswith(POIS):
            return self._edit(request, unquote(url.path.removeprefix(POIS)), url.query)
        raise _Refused(404, "there is no such page here")

    def _check_sender(self, request: Request) -> None:
        """Refuse what a page of another site sends by way of the browser."""
        host = request.headers.get("host", "").lower()
        if host not in self.hosts:
            raise _Refused(403, "Host: not an address of this page")
        origin = request.headers.get("origin", "").lower()
        if origin and origin != f"http://{host}":
            raise _Refused(403, "Origin: another page's")
        if request.headers.get("sec-fetch-site", "none") not in ("none", "same-origin") and request.target != "/":
            raise _Refused(403, "Sec-Fetch-Site: another page's")

    def _show(self, path: str, query: str) -> Response:
        if path == "/api/site":
            who = {"robot": self.robot, "by": self.by, "id_pattern": NAME_PATTERN}
            return _json(200, {**who, **self.site.described()})
        if path == "/api/map.png" and self.site.picture:
            return Response(200, "image/png", self.site.picture)
        if path == "/api/live":
            return self._live(parse_qs(query).get("version", [""])[0])
        raise _Refused(404, "there is no such page here")

    def _live(self, known: str) -> Response:
        """What goes on, with the POIs where the page has others."""
        seen = self.store.snapshot()
        content = seen.live()
        if seen.version != known:
            content["pois"] = [poi.model_dump(mode="json") for poi in seen.pois.values()]
        return _json(200, content)

    def _edit(self, request: Request, poi_id: str, query: str) -> Response:
        try:
            if request.method == "PUT":
                poi = _read(request, poi_id)
                stored = self.store.add(poi) if "new" in parse_qs(query) else self.store.put(poi)
            elif request.method == "DELETE":
                stored = self.store.delete(_read_id(poi_id))
            else:
                raise _Refused(405, f"{request.method[:10]}: POIs are put and deleted")
        except EditRefused as error:
            raise _Refused(409, str(error)) from None
        except NoAnswer as error:
            raise _Refused(503, str(error)) from None
        return _json(200, {"poi": stored.model_dump(mode="json")})


class _Refused(Exception):
    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.response = _json(status, {"error": why, "field": _field_of(why)})


def _read(request: Request, poi_id: str) -> Poi:
    """The POI of a request's body. Raises _Refused with the field's name."""
    if len(request.body) > MAX_BODY_BYTES:
        raise _Refused(413, f"body: more than {MAX_BODY_BYTES} bytes")
    if request.headers.get("content-type", "").partition(";")[0].strip() != JSON:
        raise _Refused(415, f"Content-Type: not {JSON}")
    try:
        content = codec.parse_json(request.body)
    except codec.CodecError as error:
        raise _Refused(400, f"body: {error}") from None
    unknown = sorted(content.keys() - EDITABLE)
    if unknown:
        raise _Refused(400, f"{unknown[0][:40]}: no field that is edited ({', '.join(sorted(EDITABLE))})")
    if content.setdefault("poi_id", poi_id) != poi_id:
        raise _Refused(400, "poi_id: another one than in the address")
    try:
        return codec.validate(Poi, content)
    except codec.CodecError as error:
        raise _Refused(400, str(error)) from None


def _read_id(poi_id: str) -> str:
    """The id, which may stand in a key. Raises _Refused."""
    try:
        return codec.validate(Poi, {"poi_id": poi_id, "position_m": (0, 0, 0)}).poi_id
    except codec.CodecError as error:
        raise _Refused(400, str(error)) from None


def _field_of(why: str) -> str:
    """The field that a refusal names first; of `position_m.1` the field and its place."""
    field_, colon, _ = why.partition(":")
    return field_ if colon and field_.partition(".")[0] in EDITABLE else ""


def _json(status: int, content: dict[str, Any]) -> Response:
    return Response(status, JSON, json.dumps(content, allow_nan=False).encode())
