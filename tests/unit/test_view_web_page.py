"""The page of `deixis view --web`: for this machine alone, and allowed to ask nobody else."""

import http.client
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from deixis_view.viewer_process import ViewerError
from deixis_view.web_page import WebPage, policy

VIEWER = "rerun+http://127.0.0.1:4321/proxy"


class Inner(BaseHTTPRequestHandler):
    """In the place of Rerun's own web server."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "application/wasm" if self.path.endswith(".wasm") else "text/html")
        self.end_headers()
        self.wfile.write(f"content of {self.path}".encode())

    def log_message(self, *_):
        pass


@pytest.fixture
def page():
    with ThreadingHTTPServer(("127.0.0.1", 0), Inner) as inner:
        threading.Thread(target=inner.serve_forever, daemon=True).start()
        with WebPage(0, inner.server_address[1], VIEWER) as made:
            yield made
        inner.shutdown()


def ask(page, path, host=None):
    port = int(page.url.rstrip("/").rsplit(":", 1)[1])
    link = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    link.request("GET", path, headers={"Host": host} if host else {})
    answer = link.getresponse()
    return answer, answer.read()


def test_it_leads_to_what_is_drawn_and_hands_on_rerun_s_page_with_its_policy(page):
    answer, _ = ask(page, "/")
    assert answer.status == 302
    answer, content = ask(page, answer.getheader("Location"))
    assert content == b"content of /"
    assert answer.getheader("Content-Security-Policy") == policy(VIEWER)
    answer, content = ask(page, "/re_viewer_bg.wasm")
    assert answer.getheader("Content-Type") == "application/wasm"
    assert content == b"content of /re_viewer_bg.wasm"


def test_the_policy_names_this_machine_and_nobody_else():
    names = [word for word in policy(VIEWER).split() if "://" in word]
    assert names
    assert all(name.rstrip(";") in ("http://127.0.0.1:4321", "http://localhost:4321") for name in names)
    assert policy(VIEWER).startswith("default-src 'self'")


def test_it_answers_for_its_own_name_and_files_only(page):
    assert ask(page, "/", host="pictures.example.org")[0].status == 404
    assert ask(page, "/../secret")[0].status == 404
    assert ask(page, "/other")[0].status == 404


def test_a_port_that_is_taken_is_said(page):
    port = int(page.url.rstrip("/").rsplit(":", 1)[1])
    with pytest.raises(ViewerError, match=f"--port {port}"):
        WebPage(port, 1, VIEWER)
