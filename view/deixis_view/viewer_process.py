"""Rerun's viewer as a process of its own, for this machine alone: as a window, or as the server behind a web page.

`rr.serve_grpc` and `rr.serve_web_viewer` of the library listen on all interfaces, and would show people's pictures to the
network; the program can be told not to.
"""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Self

from .workplace import Workplace

LOOPBACK = "127.0.0.1"
START_S = 20.0
STOP_S = 3.0
MEMORY = "512MiB"
"""Of what is kept for who looks back, or on from now; the oldest is dropped."""


# `2026-11-28T14:16:07.597519Z  INFO re_grpc_server: Listening ...`
AT_EASE = re.compile(r"\S+Z +(INFO|DEBUG|TRACE) ")


class ViewerError(RuntimeError):
    """A viewer that cannot be shown; the text says why."""


class ViewerProcess:
    """The viewer. Use as a context manager: it ends with us."""

    def __init__(self, *, window: bool) -> None:
        self.port, self.web_port = free_port(), free_port()
        self._window = window
        self._folder: Path
        self._child: subprocess.Popen[bytes]

    @property
    def pid(self) -> int:
        """Of the process that was started, and of its group."""
        return self._child.pid

    @property
    def url(self) -> str:
        """Where what is drawn goes, and whence the page has it."""
        return f"rerun+http://{LOOPBACK}:{self.port}/proxy"

    def __enter__(self) -> Self:
        """Start it, and wait until it listens. Raises ViewerError."""
        with ExitStack() as stack:
            self._folder = stack.enter_context(Workplace())
            self._start()
            stack.callback(self._end)
            self._await_all()
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _start(self) -> None:
        argv = [sys.executable, "-m", "deixis_view.viewer_start", str(os.getpid())]
        argv += ["--bind", LOOPBACK, "--port", str(self.port), "--server-memory-limit", MEMORY]
        if self._window:
            argv += ["--memory-limit", MEMORY, "--hide-welcome-screen", "--expect-data-soon"]
        else:
            argv += ["--serve-web", "--web-viewer-port", str(self.web_port)]
        with self._log().open("ab") as log:
            self._child = subprocess.Popen(
                argv, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=self._environment(), start_new_session=True
            )

    def _end(self) -> None:
        # The whole group: where the kernel cannot end it with us, the package starts its program as a child.
        for number in (signal.SIGTERM, signal.SIGKILL):
            try:
                os.killpg(self._child.pid, number)
                self._child.wait(STOP_S)
            except ProcessLookupError:
                break
            except subprocess.TimeoutExpired:
                continue
        self._child.wait()

    def closed(self) -> bool:
        """Whether it has ended, as when its window was closed."""
        return self._child.poll() is not None

    def failure(self) -> str:
        """Why it ended, where that was no end in good order."""
        status = self._child.poll()
        if status is None or status == 0:
            return ""
        if status < 0:
            return f"Rerun's viewer was ended by signal {-status} ({signal.strsignal(-status) or 'unknown'})"
        return f"Rerun's viewer has ended with status {status}: {self._last_words()}"

    def _await_all(self) -> None:
        for port in (self.port,) if self._window else (self.port, self.web_port):
            self._await(port)

    def _await(self, port: int) -> None:
        deadline_s = time.monotonic() + START_S
        while True:
            if self._child.poll() is not None:
                raise ViewerError(f"Rerun's viewer does not start: {self._last_words()}")
            with socket.socket() as probe:
                probe.settimeout(1.0)
                if probe.connect_ex((LOOPBACK, port)) == 0:
                    return
            if time.monotonic() > deadline_s:
                raise ViewerError(f"Rerun's viewer does not listen within {START_S:.0f} s: {self._last_words()}")
            time.sleep(0.05)

    def _environment(self) -> dict[str, str]:
        """Ours, with a configuration in which it reports nothing of its use to its makers; the user's own stays as it is."""
        folder = self._folder
        settings = folder / "rerun" / "analytics.json"
        settings.parent.mkdir()
        content = {"analytics_enabled": False, "analytics_id": "none", "metadata": {}}
        paths = {"config_file_path": str(settings), "data_dir_path": str(folder / "analytics")}
        settings.write_text(json.dumps(content | paths))
        return {**os.environ, "XDG_CONFIG_HOME": str(folder), "NO_COLOR": "1"}

    def _log(self) -> Path:
        return self._folder / "rerun.log"

    def _last_words(self) -> str:
        return last_words(self._log().read_text(errors="replace"))


def last_words(log: str) -> str:
    """What a viewer's log has last to say of what went wrong; not what it tells when all is well."""
    lines = [line for line in log.splitlines() if line.strip() and not AT_EASE.match(line)]
    return " ".join(lines[-3:])[-600:] or "it did not say why"


def has_display() -> bool:
    """Whether a window could be shown here."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def free_port() -> int:
    """A TCP port of loopback that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])
