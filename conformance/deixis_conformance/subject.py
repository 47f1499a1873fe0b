"""The process of the stage under check, where we start it ourselves."""

from __future__ import annotations

import shlex
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Self

STOP_WITHIN_S = 2.0
KILLED_WITHIN_S = 5.0
TAIL_BYTES = 2000


class SubjectError(Exception):
    """The command cannot be started; the text says why."""


class Subject:
    """A process with its log. Use as a context manager: it does not outlive it."""

    def __init__(self, command: str, robot: str, endpoint: str) -> None:
        """In `command`, `{robot}` and `{connect}` stand for the robot's name and the router's endpoint. Raises SubjectError."""
        try:
            words = shlex.split(command)
        except ValueError as error:
            raise SubjectError(f"--command: {error}") from None
        if not words or "{connect}" not in command or "{robot}" not in command:
            raise SubjectError("--command needs {robot} and {connect} where the stage's command line takes them")
        self.argv = [word.replace("{robot}", robot).replace("{connect}", endpoint) for word in words]
        self._folder = tempfile.TemporaryDirectory(prefix="deixis-check-")
        self._log = Path(self._folder.name) / "log"
        self._popen: subprocess.Popen[bytes]

    def __enter__(self) -> Self:
        with self._log.open("wb") as file:
            try:
                self._popen = subprocess.Popen(
                    self.argv, stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True
                )
            except OSError as error:
                self._folder.cleanup()
                raise SubjectError(f"--command: '{self.argv[0]}' cannot be started: {error.strerror}") from None
        return self

    def __exit__(self, *_: object) -> None:
        if self.running():
            self._popen.kill()
            self._popen.wait(KILLED_WITHIN_S)
        self._folder.cleanup()

    def running(self) -> bool:
        """Whether it has not ended."""
        return self._popen.poll() is None

    def status(self) -> int | None:
        """Its exit status; none while it runs."""
        return self._popen.poll()

    def terminate(self) -> float | None:
        """Send SIGTERM: the seconds until it ended; none where it did not within 2 s."""
        began_s = time.monotonic()
        self._popen.send_signal(signal.SIGTERM)
        try:
            self._popen.wait(STOP_WITHIN_S)
        except subprocess.TimeoutExpired:
            return None
        return time.monotonic() - began_s

    def last_words(self) -> str:
        """The end of its log."""
        return self._log.read_bytes()[-TAIL_BYTES:].decode(errors="replace").strip()
