"""A real browser without a screen, told what to do over a pipe: Debian's chromium, which draws by SwiftShader, with no GPU."""

from __future__ import annotations

import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest

CHROMIUM = shutil.which("chromium")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here (apt install chromium)")
FLAGS = (
    *("--headless=new", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-extensions"),
    *("--remote-debugging-pipe", "--hide-scrollbars"),
)
ANSWER_S = 120.0
PATIENCE_S = 30.0


class Page:
    """One page of a browser."""

    def __init__(self, to: int, from_: int) -> None:
        self._asked: dict[str, str] = {}
        self._to, self._from = to, from_
        self._number = 0
        self._bytes = b""
        self._session: str | None = None
        self.errors: list[str] = []
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        # Not its console: Rerun's page writes megabytes there.
        for domain in ("Network", "Page"):
            self._ask(f"{domain}.enable")

    @property
    def hosts(self) -> set[str]:
        """`host:port` of all that the page has asked for anything."""
        return set(self._asked.values())

    def open(self, url: str) -> None:
        """Go there."""
        self._ask("Page.navigate", url=url)

    def look(self) -> np.ndarray:
        """What is to be seen, BGR."""
        png = base64.b64decode(self._ask("Page.captureScreenshot", format="png")["data"])
        return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)

    def note_errors(self) -> None:
        """From now on keep in `errors` what the page's script throws and what the browser forbids it."""
        for domain in ("Runtime", "Log"):
            self._ask(f"{domain}.enable")

    def run(self, script: str) -> Any:
        """The value of an expression on the page."""
        result = self._ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait_for(self, script: str) -> Any:
        """The expression's first true value."""
        deadline_s = time.monotonic() + PATIENCE_S
        while not (value := self.run(script)):
            assert time.monotonic() < deadline_s, f"not within {PATIENCE_S:g} s: {script}; {self.errors}\n{self.text()}"
            self.wait(0.05)
        return value

    def text(self) -> str:
        """What can be read on the page."""
        return str(self.run("document.body.innerText"))

    def mouse(self, kind: str, x: float, y: float) -> None:
        """One event of the left button at a pixel of the page: mousePressed, mouseMoved or mouseReleased."""
        self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def click(self, x: float, y: float) -> None:
        """Click there."""
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
        self._ask("Input.insertText", text=text)

    def press(self, selector: str) -> None:
        """Press a button."""
        self.run(f"document.querySelector({json.dumps(selector)}).click()")

    def wait(self, seconds: float) -> None:
        """Let the page go on, and hear what it does."""
        deadline_s = time.monotonic() + seconds
        while (left_s := deadline_s - time.monotonic()) > 0:
            self._hear(left_s)

    def _ask(self, method: str, **params: Any) -> dict[str, Any]:
        self._number += 1
        call = {"id": self._number, "method": method, "params": params}
        if self._session:
            call["sessionId"] = self._session
        os.write(self._to, json.dumps(call).encode() + b"\0")
        deadline_s = time.monotonic() + ANSWER_S
        while (left_s := deadline_s - time.monotonic()) > 0:
            for message in self._hear(left_s):
                if message.get("id") == self._number:
                    assert "error" not in message, f"{method}: {message['error']}"
                    return message["result"]
        raise TimeoutError(f"the browser did not answer {method} within {ANSWER_S:.0f} s")

    def _hear(self, timeout_s: float) -> list[dict[str, Any]]:
        if not select.select([self._from], [], [], timeout_s)[0]:
            return []
        data = os.read(self._from, 1 << 20)
        if not data:
            raise ConnectionError("the browser is gone")
        *whole, self._bytes = (self._bytes + data).split(b"\0")
        messages = [json.loads(text) for text in whole]
        for message in messages:
            self._note(message.get("method"), message.get("params", {}))
        return messages

    def _note(self, method: str | None, params: dict[str, Any]) -> None:
        if method == "Network.requestWillBeSent" and params["request"]["url"].startswith("http"):
            self._asked[params["requestId"]] = urlsplit(params["request"]["url"]).netloc
        elif method == "Network.loadingFailed" and params.get("blockedReason") == "csp":
            self._asked.pop(params["requestId"], None)  # the browser did not let it go out
        elif method == "Runtime.exceptionThrown":
            self.errors.append(str(params["exceptionDetails"].get("exception", params).get("description", params)))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error" and params["entry"]["source"] != "network":
            # A request that is refused, as a test has it refused, is no fault of the page.
            self.errors.append(f"{params['entry']['text']} {params['entry'].get('url', '')}")


@contextmanager
def page(folder: Path, size: tuple[int, int], *flags: str) -> Iterator[Page]:
    """A browser with one page of this size; its profile lies in `folder`."""
    to_child, to = os.pipe()
    from_, from_child = os.pipe()
    # Out of the way of 3 and 4, which the browser reads and writes. A shell lays them there: what Python runs between fork and
    # exec is unsafe with threads.
    ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 100) for end in (to_child, from_child)]
    os.close(to_child)
    os.close(from_child)

    argv = [CHROMIUM, *FLAGS, f"--window-size={size[0]},{size[1]}", f"--user-data-dir={folder / 'profile'}", *flags]
    with (folder / "browser.log").open("ab") as log:
        child = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{ends[0]} 4>&{ends[1]}', "bash", *argv],
            stdin=subprocess.DEVNULL, stdout=log, stderr=log, pass_fds=ends, start_new_session=True,
        )  # fmt: skip
    for end in ends:
        os.close(end)
    try:
        yield Page(to, from_)
    finally:
        child.terminate()
        try:
            child.wait(10)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        os.close(to)
        os.close(from_)
