"""A real browser without a window, driven by its DevTools protocol over a pipe: no driver of its own, no port, no library."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

PATIENCE_S = 30.0
NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--headless=new",
    "--remote-debugging-pipe",
    "--no-sandbox",  # in a container or as root there is none to be had; it opens our own page only
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
    "--hide-scrollbars",
)
# The browser reads from file 3 and writes to file 4, which here are others.
EXEC = "import os, sys; r, w = map(int, sys.argv[1:3]); os.dup2(r, 103); os.dup2(w, 104); os.dup2(103, 3); os.dup2(104, 4); "
EXEC += "os.execv(sys.argv[3], sys.argv[3:])"


class Browser:
    """One page of a browser."""

    def __init__(self, into: int, out: int) -> None:
        self._into = into
        self._out = out
        self._buffer = b""
        self._number = 0
        self._session: str | None = None
        self.errors: list[str] = []

    def open(self, url: str, width: int = 1280, height: int = 800) -> None:
        """Open an address in a new page of this size."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=url)

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a method of the protocol; its result. What the page complains of meanwhile is kept in `errors`."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._into, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next(method)
            if answer.get("id") == self._number:
                assert "error" not in answer, f"{method}: {answer.get('error')}"
                return dict(answer["result"])
            self._note(answer)

    def run(self, script: str) -> Any:
        """The value of an expression on the page."""
        result = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait_for(self, script: str) -> Any:
        """The expression's first true value."""
        deadline_s = time.monotonic() + PATIENCE_S
        while not (value := self.run(script)):
            assert time.monotonic() < deadline_s, f"not within {PATIENCE_S:g} s: {script}; {self.errors}\n{self.text()}"
            time.sleep(0.05)
        return value

    def text(self) -> str:
        """What can be read on the page."""
        return str(self.run("document.body.innerText"))

    def mouse(self, kind: str, x: float, y: float) -> None:
        """One event of the left button: mousePressed, mouseMoved or mouseReleased."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def click(self, x: float, y: float) -> None:
        """Click at a place of the page, pixels."""
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press at one place, move to another, and let go."""
        self.mouse("mousePressed", *start)
        for share in (0.3, 0.7, 1.0):
            self.mouse("mouseMoved", *(a + share * (b - a) for a, b in zip(start, end, strict=True)))
        self.mouse("mouseReleased", *end)

    def type_into(self, selector: str, text: str) -> None:
        """Replace what stands in a field, as by typing."""
        self.run(f"document.querySelector({json.dumps(selector)}).select()")
        self.run(f"document.querySelector({json.dumps(selector)}).focus()")
        self.call("Input.insertText", text=text)

    def press(self, selector: str) -> None:
        """Press a button."""
        self.run(f"document.querySelector({json.dumps(selector)}).click()")

    def picture(self, path: Path) -> None:
        """What the page looks like, as PNG."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def _note(self, event: dict[str, Any]) -> None:
        params = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            self.errors.append(str(params["exceptionDetails"].get("exception", params).get("description", params)))
        # A request that is refused, as a test has it refused, is no fault of the page.
        elif event.get("method") == "Log.entryAdded" and (params["entry"]["level"], params["entry"]["source"]) != (
            "error",
            "network",
        ):
            self.errors.append(f"{params['entry']['text']} {params['entry'].get('url', '')}")

    def _next(self, waits_for: str) -> dict[str, Any]:
        deadline_s = time.monotonic() + PATIENCE_S
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._out], [], [], max(0.0, deadline_s - time.monotonic()))
            assert ready, f"the browser does not answer {waits_for}"
            read = os.read(self._out, 1 << 20)
            assert read, f"the browser ended while it was asked for {waits_for}"
            self._buffer += read
        message, _, self._buffer = self._buffer.partition(b"\0")
        return dict(json.loads(message))


@contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """A browser with its profile in `folder`; skips the test where none is installed."""
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip("no browser is installed (on Debian: apt install chromium)")
    reads, into = os.pipe()
    out, writes = os.pipe()
    argv = [sys.executable, "-c", EXEC, str(reads), str(writes), program, *OPTIONS, f"--user-data-dir={folder}"]
    with (folder.parent / "browser.log").open("wb") as log:
        child = subprocess.Popen(argv, pass_fds=(reads, writes), stdin=subprocess.DEVNULL, stdout=log, stderr=log)
    os.close(reads)
    os.close(writes)
    try:
        yield Browser(into, out)
    finally:
        os.close(into)
        child.terminate()
        try:
            child.wait(10)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        os.close(out)
