"""The web page: Rerun's own, which comes with its package, handed on with a policy that lets it speak to this machine alone.

By itself it asks for fonts, news and examples of the internet and reports its use; a browser that is told the policy does not.
"""

from __future__ import annotations

import errno
import http.client
import shutil
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self
from urllib.parse import quote, urlsplit

from .viewer_process import LOOPBACK, ViewerError

FILES = frozenset(("/", "/index.html", "/re_viewer.js", "/re_viewer_bg.wasm", "/favicon.ico", "/favicon.svg", "/sw.js"))
HOSTS = (LOOPBACK, "localhost")
TIMEOUT_S = 10.0


class WebPage:
    """Serves the page on loopback. Use as a context manager. port: 0 takes a free one."""

    def __init__(self, port: int, inner_port: int, viewer_url: str) -> None:
        """inner_port: of Rerun's own web server. viewer_url: whence the page has what is drawn. Raises ViewerError."""
        handler = type("Handler", (_Handler,), {"inner_port": inner_port, "viewer_url": viewer_url})
        try:
            self._server = ThreadingHTTPServer((LOOPBACK, port), handler)
        except OSError as error:
            raise ViewerError(f"--port {port}: {error.strerror}{_advice(error)}") from None
        self._server.daemon_threads = True
        self.url = f"http://{LOOPBACK}:{self._server.server_address[1]}/"
        self._thread = threading.Thread(target=self._server.serve_forever, name="web", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()


def _advice(error: OSError) -> str:
    taken = error.errno == errno.EADDRINUSE
    return "; another viewer may be running there: --port N takes another port, 0 a free one" if taken else ""


def policy(viewer_url: str) -> str:
    """The page's Content-Security-Policy: what it may load and ask. viewer_url: as `rerun+http://HOST:PORT/proxy`."""
    port = urlsplit(viewer_url.removeprefix("rerun+")).port
    data = " ".join(f"http://{host}:{port}" for host in HOSTS)
    return (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        f"img-src 'self' data: blob:; worker-src 'self' blob:; connect-src 'self' data: blob: {data}; frame-ancestors 'none'"
    )


class _Handler(BaseHTTPRequestHandler):
    inner_port: int
    viewer_url: str
    timeout = TIMEOUT_S

    def do_GET(self) -> None:
        # A page of elsewhere whose name was pointed at loopback is not answered.
        host = (self.headers.get("Host") or "").rsplit(":", 1)[0]
        parts = urlsplit(self.path)
        if host not in HOSTS or parts.path not in FILES:
            self.send_error(HTTPStatus.NOT_FOUND)
        elif parts.path == "/" and "url=" not in parts.query:
            self.send_response(HTTPStatus.FOUND)
            self.send_header("Location", f"/?url={quote(self.viewer_url, safe='')}")
            self.end_headers()
        else:
            self._hand_on(parts.path)

    def _hand_on(self, path: str) -> None:
        inner = http.client.HTTPConnection(LOOPBACK, self.inner_port, timeout=TIMEOUT_S)
        try:
            inner.request("GET", path)
            answer = inner.getresponse()
            self.send_response(answer.status)
            for name in ("Content-Type", "Content-Length", "Content-Encoding", "rerun-final-length"):
                if value := answer.getheader(name):
                    self.send_header(name, value)
            self.send_header("Content-Security-Policy", policy(self.viewer_url))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            shutil.copyfileobj(answer, self.wfile)
        except (OSError, http.client.HTTPException):
            self.close_connection = True  # the browser went away, or the viewer did; the command says which
        finally:
            inner.close()

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing of each file that is fetched."""
