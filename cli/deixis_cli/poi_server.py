"""The HTTP server of `deixis poi edit`.

By the standard library: one page for one or two people needs no framework, and a robot no further dependency.
"""

from __future__ import annotations

import ipaddress
import logging
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files

from .poi_requests import FILES, MAX_BODY_BYTES, Page, Request, Response

log = logging.getLogger("deixis-poi-edit")

# Of one connection: who says nothing for so long is hung up on.
SILENT_S = 20.0
MAX_CONNECTIONS = 32
# The page takes nothing from elsewhere, is shown in no other page, and tells nobody its address.
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def page_files() -> dict[str, bytes]:
    """The page's own files, by name."""
    folder = files("deixis_cli") / "poi_page"
    return {name: (folder / name).read_bytes() for name, _ in FILES.values()}


def host_names(address: str, port: int) -> frozenset[str]:
    """What `Host` says in a request to this address: it and, where it stands for several, those that lead to this host."""
    names = {address}
    where = ipaddress.ip_address(address)
    if where.is_loopback or where.is_unspecified:
        names |= {"localhost", "127.0.0.1", "::1"}
    if where.is_unspecified:
        names |= {socket.gethostname().lower(), socket.getfqdn().lower(), *_own_addresses()}
    return frozenset(f"[{name}]:{port}" if ":" in name else f"{name}:{port}" for name in names)


def _own_addresses() -> set[str]:
    try:
        found = socket.getaddrinfo(socket.gethostname(), None)
    except OSError:
        return set()
    addresses = {str(entry[4][0]) for entry in found}
    # The name often leads to loopback alone; a datagram socket tells which address it would send from, and sends nothing.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
            addresses.add(probe.getsockname()[0])
        except OSError:
            pass  # no way out of this host: then nobody comes in by one
    return addresses


class PageServer(ThreadingHTTPServer):
    """Listens at an address, and answers with a page from when it has one."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, address: str, port: int) -> None:
        """Raises OSError where it cannot listen there."""
        self.page: Page | None = None
        self._places = threading.BoundedSemaphore(MAX_CONNECTIONS)
        if ":" in address:
            self.address_family = socket.AF_INET6
        super().__init__((address, port), _Handler)

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self.server_address[1])

    def verify_request(self, _request: object, _client: object) -> bool:
        """Whether there is a place for one more; `shutdown_request` gives it back."""
        return self._places.acquire(blocking=False)

    def process_request_thread(self, request: object, client_address: object) -> None:
        """Serve one connection."""
        try:
            super().process_request_thread(request, client_address)  # type: ignore[arg-type]
        finally:
            self._places.release()

    def handle_error(self, _request: object, client_address: object) -> None:
        """A connection that broke is the browser's affair; all else is ours."""
        log.warning("a request of %s failed", client_address, exc_info=True)


@contextmanager
def serving(server: PageServer) -> Iterator[None]:
    """While entered, requests are answered, by threads."""
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True, name="page")
    thread.start()
    try:
        yield
    finally:
        server.shutdown()
        server.server_close()


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    protocol_version = "HTTP/1.1"
    server_version = "deixis"
    sys_version = ""
    timeout = SILENT_S

    def handle(self) -> None:
        with suppress(ConnectionError, TimeoutError):  # the browser has hung up, as it does when a page is left
            super().handle()

    def do_GET(self) -> None:
        self._answer(b"")

    def do_PUT(self) -> None:
        self._answer(self._body())

    def do_DELETE(self) -> None:
        self._answer(self._body())

    def _body(self) -> bytes:
        """What was sent along, cut to one byte more than is allowed; then the connection is not used again."""
        length = self.headers.get("Content-Length", "0")
        if "Transfer-Encoding" in self.headers or not length.isascii() or not length.isdigit() or int(length) > MAX_BODY_BYTES:
            self.close_connection = True
            return b" " * (MAX_BODY_BYTES + 1)
        return self.rfile.read(int(length))

    def _answer(self, body: bytes) -> None:
        page = self.server.page
        if page is None:
            self.send_error(503)
            return
        headers = {name.lower(): value for name, value in self.headers.items()}
        self._send(page.answer(Request(self.command, self.path, headers, body)))

    def _send(self, response: Response) -> None:
        self.send_response(response.status)
        self.send_header("Content-Type", response.content_type)
        self.send_header("Content-Length", str(len(response.body)))
        if self.close_connection:
            self.send_header("Connection", "close")
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(response.body)

    def log_message(self, *_: object) -> None:
        """A page that asks twice a second is not logged."""
