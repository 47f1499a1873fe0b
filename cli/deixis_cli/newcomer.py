"""Where a newcomer comes from: a command of ours, a process that stands by already, or the supervisor of the stage."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

import zenoh
from deixis_runtime.settings import STAND_BY
from deixis_runtime.supervisor import say_status
from deixis_schemas import topics
from deixis_schemas.messages import Voice

from .gets import get_all
from .options import CommandError

STOP_WITHIN_S = 4.0
ASK_WITHIN_S = 3.0


class Newcomer(Protocol):
    """One that is to take a place. instance: where it is known before it stands by; ours: it ends with this command."""

    instance: str | None
    ours: bool

    def ended(self) -> str:
        """How it has ended, in words; empty while it runs, as far as we know."""

    def keep(self, heard: Callable[[], set[str]]) -> None:
        """From now on it may get the place: at the end it is left alone where it is `heard`."""

    def end(self) -> None:
        """We are done: end it, where that is ours to do."""


class OwnNewcomer:
    """A process that we start. It prints on our standard error."""

    ours = True

    def __init__(self, command: str, robot: str, endpoint: str) -> None:
        """In `command`, `{robot}` and `{connect}` stand for the robot's name and the router's endpoint. Raises CommandError."""
        self.instance: str | None = None
        try:
            words = [word.replace("{robot}", robot).replace("{connect}", endpoint) for word in shlex.split(command)]
        except ValueError as error:
            raise CommandError(f"--command: {error}") from None
        if not words:
            raise CommandError("--command: it is empty")
        try:
            # A group of its own: Ctrl-C is for us, who end it.
            self._popen = subprocess.Popen(
                words, stdin=subprocess.DEVNULL, stdout=sys.stderr.fileno(), process_group=0, env={**os.environ, STAND_BY: "1"}
            )
        except (OSError, ValueError) as error:  # ValueError: a NUL in a word
            why = error.strerror if isinstance(error, OSError) else error
            raise CommandError(f"--command: '{words[0]}' cannot be started: {why}") from None

    def ended(self) -> str:
        """How it has ended."""
        status = self._popen.poll()
        return "" if status is None else say_status(status)

    def keep(self, heard: Callable[[], set[str]]) -> None:
        """It ends with this command, whether it is heard or not."""

    def end(self) -> None:
        """SIGTERM to all of its group, and SIGKILL where it stays."""
        with suppress(ProcessLookupError):
            os.killpg(self._popen.pid, signal.SIGTERM)
            os.killpg(self._popen.pid, signal.SIGCONT)
        try:
            self._popen.wait(STOP_WITHIN_S)
        except subprocess.TimeoutExpired:
            with suppress(ProcessLookupError):
                os.killpg(self._popen.pid, signal.SIGKILL)
            self._popen.wait()


class GivenNewcomer:
    """A process that somebody else has started, and looks after."""

    ours = False

    def __init__(self, instance: str) -> None:
        self.instance: str | None = instance

    def ended(self) -> str:
        """We do not know; its token tells."""
        return ""

    def keep(self, heard: Callable[[], set[str]]) -> None:
        """Nothing to do."""

    def end(self) -> None:
        """It is not ours."""


class SupervisedNewcomer:
    """A second process of the stage, which its supervisor starts and keeps."""

    ours = False

    def __init__(self, session: zenoh.Session, robot: str, stage: str, sets: tuple[str, ...], old: str) -> None:
        """Have it started by whichever supervisor runs the stage, with these settings behind its own. Raises CommandError."""
        self._session = session
        self._stage = stage
        self._key = topics.VOICE.key(robot, stage=topics.SUPERVISOR, id="*")
        self._heard: Callable[[], set[str]] = set
        told, why = self._ask("start", json.dumps(list(sets)).encode())
        if told is None:
            whose = f"no supervisor ('deixis run', 'deixis up') answers for {stage}/{old}"
            raise CommandError(
                f"{why or whose}; start a newcomer with --command, or by hand with {STAND_BY}=1 and name it with --instance"
            )
        self.instance: str | None = told.other
        # All other supervisors refuse; from now on the one is asked that has it.
        self._key = topics.VOICE.key(robot, stage=topics.SUPERVISOR, id=told.instance)

    def ended(self) -> str:
        """How it has ended, as its supervisor says. One that is heard has not: when the old one is gone it is no newcomer."""
        told, why = self._ask("")
        return "" if told is not None or self.instance in self._heard() else why

    def keep(self, heard: Callable[[], set[str]]) -> None:
        """Leave it alone at the end where it is heard."""
        self._heard = heard

    def end(self) -> None:
        """Have it stopped where it has not got the place; where it has, its supervisor refuses by itself."""
        if self.instance not in self._heard():
            self._ask("stop")

    def _ask(self, op: str, payload: bytes | None = None) -> tuple[Voice | None, str]:
        """The answer of the supervisor that runs the stage, or why there is none; empty where nobody answers."""
        selector = f"{self._key}?op={op};stage={self._stage}" if op else f"{self._key}?stage={self._stage}"
        good, bad = get_all(self._session, selector, Voice, payload=payload, timeout_s=ASK_WITHIN_S)
        if good:
            return good[0][1], ""
        # Of several supervisors, those that do not run the stage say the least.
        reasons = sorted((refusal.reason for refusal in bad), key=lambda reason: "is not started here" in reason)
        return None, reasons[0] if reasons else ""
