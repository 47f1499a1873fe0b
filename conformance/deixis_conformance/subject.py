"""The process of the stage under check, where we start it ourselves."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import threading
import time
from contextlib import suppress
from typing import IO, Self

STOP_WITHIN_S = 2.0
KILLED_WITHIN_S = 5.0
READ_OUT_WITHIN_S = 0.5
TAIL_BYTES = 2000


class SubjectError(Exception):
    """The command cannot be started; the text says why."""


class Subject:
    """A process and the end of what it prints. Use as a context manager: neither it nor what it started outlives it."""

    def __init__(self, command: str, robot: str, endpoint: str) -> None:
        """In `command`, `{robot}` and `{connect}` stand for the robot's name and the router's endpoint. Raises SubjectError."""
        try:
            words = shlex.split(command)
        except ValueError as error:
            raise SubjectError(f"--command: {error}") from None
        if not words or "{connect}" not in command or "{robot}" not in command:
            raise SubjectError("--command needs {robot} and {connect} where the stage's command line takes them")
        self.argv = [word.replace("{robot}", robot).replace("{connect}", endpoint) for word in words]
        self._printed = b""
        self._popen: subprocess.Popen[bytes]
        self._reader: threading.Thread

    def __enter__(self) -> Self:
        try:
            self._popen = subprocess.Popen(
                self.argv, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True
            )
        except (OSError, ValueError) as error:  # ValueError: a NUL in a word
            why = error.strerror if isinstance(error, OSError) else error
            raise SubjectError(f"--command: '{self.argv[0]}' cannot be started: {why}") from None
        assert self._popen.stdout is not None
        # A file would fill the disk where the stage prints without end.
        self._reader = threading.Thread(target=self._read, args=(self._popen.stdout,), name="subject-output", daemon=True)
        self._reader.start()
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(ProcessLookupError):  # nobody of its group is left
            os.killpg(self._popen.pid, signal.SIGKILL)
        self._popen.wait(KILLED_WITHIN_S)
        self._reader.join(READ_OUT_WITHIN_S)

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
        """The end of what it has printed."""
        if not self.running():
            self._reader.join(READ_OUT_WITHIN_S)
        return self._printed.decode(errors="replace").strip()

    def _read(self, pipe: IO[bytes]) -> None:
        with pipe:
            while chunk := os.read(pipe.fileno(), 65_536):
                self._printed = (self._printed + chunk)[-TAIL_BYTES:]
