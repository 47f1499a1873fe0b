"""Compares the clock of another stage's host with ours while both run: a get of its health now and then."""

from __future__ import annotations

import socket
import threading
import time
from collections import deque

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import ClockHealth, Health

from .clock_offset import ClockOffset, Exchange, Offset, surely_passed_ns
from .delivery import GET_PRIORITY

TIMEOUT_S = 1.9
MAX_WAITING = 8
# Stamps of two hosts are set beside each other by people and by robot poses: what differs by more is worth a word.
SAID_NS = 300_000_000


class ClockWatch:
    """The clock of one stage of the robot. The callback only notes times; decoding happens in `turn`, in the loop."""

    def __init__(self, session: zenoh.Session, robot: str, stage: str) -> None:
        self.stage = stage
        self.key = topics.HEALTH.key(robot, stage=stage)
        self.host = ""
        self._session = session
        self._offset = ClockOffset()
        self._instance = ""
        self._lock = threading.Lock()
        self._answers: deque[tuple[int, int, bytes, str]] = deque(maxlen=MAX_WAITING)

    def turn(self) -> None:
        """Take in what was answered, and ask again. Called with each heartbeat, once a second."""
        self._take_answers()
        self._ask()

    def offset(self) -> Offset | None:
        """How far the stage's clock is ahead of our wall clock now. None where that is not known, or not any more."""
        now_ns = time.monotonic_ns()
        offset = self._offset.at(now_ns)
        return None if offset is None else offset.beside(time.time_ns() - now_ns)

    def age_ns(self, stamp_ns: int, now_ns: int) -> int | None:
        """How long ago a stamp of the stage's clock is at least, at `now_ns` of our monotonic clock. None as in `offset`."""
        offset = self._offset.at(now_ns)
        return None if offset is None else surely_passed_ns(stamp_ns, now_ns, offset)

    def forget(self) -> None:
        """The stage's clock was set: what was known of it is wrong until it has answered again."""
        self._offset.forget()

    def health(self) -> ClockHealth | None:
        """What is known, for the health record."""
        offset = self.offset()
        if offset is None:
            return None
        return ClockHealth(
            stage=self.stage,
            host=self.host,
            ahead_s=round(offset.ahead_ns / 1e9, 6),
            uncertain_s=round(offset.uncertain_ns / 1e9, 6),
        )

    def complaint(self) -> str | None:
        """What is to be said of the clock; None where it is near enough to ours."""
        offset = self.offset()
        return (
            None
            if offset is None
            else say_skew(f"host {self.host} ({self.stage})", offset, f"that of host {socket.gethostname()}")
        )

    def _ask(self) -> None:
        asked_ns = time.monotonic_ns()

        def note(reply: zenoh.Reply) -> None:
            returned_ns = time.monotonic_ns()
            if reply.ok is not None:
                with self._lock:
                    self._answers.append((asked_ns, returned_ns, reply.ok.payload.to_bytes(), str(reply.ok.encoding)))

        self._session.get(
            self.key, note, timeout=TIMEOUT_S, priority=GET_PRIORITY, congestion_control=zenoh.CongestionControl.DROP
        )

    def _take_answers(self) -> None:
        with self._lock:
            answers = list(self._answers)
            self._answers.clear()
        for asked_ns, returned_ns, payload, encoding in answers:
            try:
                health = codec.decode(Health, payload, encoding)
            except codec.CodecError:
                continue  # whose health breaks the contract is named by those who read it; its clock stays unknown
            if health.instance != self._instance:
                self._offset.forget()
                self._instance, self.host = health.instance, health.host
            self._offset.note(Exchange(asked_ns, health.stamp_ns, returned_ns))


def say_skew(whose: str, offset: Offset, ours: str) -> str | None:
    """That a clock is off, in words; None where it may be nearer than `SAID_NS`."""
    if abs(offset.surely_ns) < SAID_NS:
        return None
    way = "ahead of" if offset.ahead_ns > 0 else "behind"
    return f"the clock of {whose} is {say_seconds(abs(offset.ahead_ns) / 1e9)} {way} {ours}"


def say_seconds(seconds: float) -> str:
    """A time span in words, to three digits or the second: `0.42 s`, `7.0 s`, `5 min 3 s`, `2 h 0 min`, `20000 days`."""
    if seconds < 120:
        return f"{seconds:.2g} s" if seconds < 1 else f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 7200:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min" if whole < 172_800 else f"{whole // 86_400} days"
