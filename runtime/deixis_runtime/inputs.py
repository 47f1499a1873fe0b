"""What a stage hears: the newest samples of a key, decoded in the loop, counted and bounded."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import zenoh
from deixis_schemas import codec
from deixis_schemas.messages import FrameId, InputHealth, Message, OfFrame, Produced
from deixis_schemas.topics import Topic

from .age import RelativeAge
from .clock_watch import ClockWatch
from .rate import Rate

T = TypeVar("T", bound=Message)

HEARD_WITHIN_S = 3.0
MAX_PRODUCERS = 8
MAX_OVERSIZED = 1024


@dataclass
class _Heard:
    """A producer: when it was heard first and last (monotonic), and of which frames it spoke then."""

    began_s: float
    last_s: float
    first: FrameId | None
    last: FrameId | None

    def ended_before(self, newer: _Heard) -> bool:
        """Whether it was replaced by the newer one: in time or, where their messages crossed on the way, by the frames."""
        if self.last_s < newer.began_s:
            return True
        if self.last is None or newer.first is None or self.last.run != newer.first.run:
            return False
        return self.last.seq < newer.first.seq


class Subscription(Generic[T]):
    """The last `depth` samples of one key.

    The Zenoh callback only stores; a FIFO behind a slow consumer would lag without bound. Decoding happens in `take`, in
    the stage's loop, where a bad payload is counted and reported and never raised. There, too, messages older than the topic
    allows are dropped: a link that was cut gives out seconds of frames at once when it is mended.
    """

    def __init__(
        self,
        topic: Topic,
        key: str,
        depth: int,
        wake: Callable[[], None],
        report: Callable[[str, str], None],
        *,
        lockstep: bool = False,
        clock: ClockWatch | None = None,
    ) -> None:
        """In `lockstep` no age is judged: time is that of the frames, which wait for us. `clock`: the one of the stamps."""
        self.topic = topic
        self.key = key
        self.received = 0
        self.used = 0
        self.overwritten = 0
        self.rejected = 0
        self.too_old = 0
        self.last_error = ""
        self.last_error_kind = ""
        self._wake = wake
        self._report = report
        self._lock = threading.Lock()
        self._samples: deque[tuple[int, zenoh.Sample]] = deque(maxlen=depth)
        self._oversized: deque[tuple[str, int]] = deque(maxlen=MAX_OVERSIZED)
        self._heard: dict[str, _Heard] = {}
        self._accepted_s: float | None = None
        self._rate = Rate(time.monotonic())
        self._max_age_s = None if lockstep else topic.max_age_s
        self._age = RelativeAge()
        self._clock = clock
        self._of_last_look = (0, 0)

    def store(self, sample: zenoh.Sample) -> None:
        """Callback of the Zenoh subscriber; runs on one of its threads."""
        received_ns = time.monotonic_ns()
        size = len(sample.payload)
        with self._lock:
            self.received += 1
            if size > self.topic.max_bytes:
                # Not kept until the loop comes to refuse it: a few of any size fill the memory.
                self._oversized.append((str(sample.key_expr), size))
                self._wake()
                return
            if len(self._samples) == self._samples.maxlen:
                self.overwritten += 1
            self._samples.append((received_ns, sample))
        self._wake()

    def take(self) -> T | None:
        """The newest valid message not taken yet; older ones are dropped."""
        messages = self.take_all()
        if not messages:
            return None
        self.overwritten += len(messages) - 1
        self.used -= len(messages) - 1
        return messages[-1]

    def take_all(self) -> list[T]:
        """All kept valid messages not taken yet, oldest first."""
        with self._lock:
            samples, oversized = list(self._samples), list(self._oversized)
            self._samples.clear()
            self._oversized.clear()
        for key, size in oversized:
            self._reject(key, codec.Malformed(codec.oversize(size, self.topic.max_bytes)))
        decoded = [(at, message) for at, sample in samples if (message := self._decode(sample)) is not None]
        messages = self._young(decoded)
        if messages:
            self._accepted_s = time.monotonic()
        self.used += len(messages)
        return messages

    def all_too_old(self) -> bool:
        """Whether messages came to be taken since the last call, and all of them were dropped for their age."""
        used, too_old = self._of_last_look
        self._of_last_look = self.used, self.too_old
        return self.too_old > too_old and self.used == used

    def age_s(self) -> float | None:
        """Seconds since the last accepted message; None if there was none."""
        return None if self._accepted_s is None else time.monotonic() - self._accepted_s

    def producers(self) -> list[str]:
        """`stage/instance` of those who publish here now; more than one is worth an alarm.

        A producer that fell silent when the newest one began was replaced by it, as after a restart or by a hot swap, and is
        left out.
        """
        now = time.monotonic()
        self._heard = {who: heard for who, heard in self._heard.items() if now - heard.last_s < HEARD_WITHIN_S}
        if not self._heard:
            return []
        newest = max(self._heard.values(), key=lambda heard: heard.began_s)
        return sorted(who for who, heard in self._heard.items() if heard is newest or not heard.ended_before(newest))

    def health(self) -> InputHealth:
        """Counters for the health record."""
        return InputHealth(
            key=self.key,
            received=self.received,
            used=self.used,
            overwritten=self.overwritten,
            too_old=self.too_old,
            rejected=self.rejected,
            last_error=self.last_error,
            age_s=self.age_s(),
            rate_hz=self._rate.of(self.received, time.monotonic()),
            producers=self.producers(),
        )

    def _decode(self, sample: zenoh.Sample) -> T | None:
        key = str(sample.key_expr)
        try:
            if sample.kind != zenoh.SampleKind.PUT:
                raise codec.Malformed("a delete, which this key does not take")
            message = codec.decode(
                self.topic.type, sample.payload.to_bytes(), str(sample.encoding), max_bytes=self.topic.max_bytes
            )
        except codec.CodecError as error:
            self._reject(key, error)
            return None
        self.last_error_kind = ""
        if isinstance(message, Produced):
            self._hear(key, message)
        return message  # type: ignore[return-value]

    def _reject(self, key: str, error: codec.CodecError) -> None:
        self.rejected += 1
        self.last_error = str(error)[:500]
        self.last_error_kind = _KINDS[type(error)]
        self._report(f"rejected {key}", f"{key}: rejected: {error}")

    def _young(self, messages: list[tuple[int, T]]) -> list[T]:
        limit_s = self._max_age_s
        if limit_s is None:
            return [message for _, message in messages]
        # All are noted before the first is judged: the newest of a backlog tells how old the others are.
        for received_ns, message in messages:
            if isinstance(message, OfFrame):
                set_back = self._age.note(message.run, message.seq, message.stamp_ns, received_ns)
                if set_back and self._clock is not None:
                    self._clock.forget()
        now_ns = time.monotonic_ns()
        aged = [(self._age_s(message, now_ns), message) for _, message in messages]
        young = [message for age_s, message in aged if age_s <= limit_s]
        if len(young) < len(aged):
            self.too_old += len(aged) - len(young)
            oldest_s = max(age_s for age_s, _ in aged)
            self._report(f"age {self.key}", f"{self.key}: dropped, {oldest_s:.1f} s old; the limit is {limit_s:g} s")
        return young

    def _age_s(self, message: T, now_ns: int) -> float:
        if not isinstance(message, OfFrame):
            return 0.0
        # Beside the quickest one, a backlog shows at once, whatever the clocks; one that has stood for long, as before a full
        # link, shows by the clocks alone.
        by_clock_ns = None if self._clock is None else self._clock.age_ns(message.stamp_ns, now_ns)
        return max(self._age.age_s(message.stamp_ns, now_ns), (by_clock_ns or 0) / 1e9)

    def _hear(self, key: str, message: Produced) -> None:
        now, who = time.monotonic(), f"{message.stage}/{message.instance}"
        frame = message.frame_id if isinstance(message, OfFrame) else None
        if who in self._heard:
            self._heard[who].last_s, self._heard[who].last = now, frame
        elif len(self._heard) < MAX_PRODUCERS:
            self._heard[who] = _Heard(now, now, frame, frame)
        if len(self._heard) > 1 and len(producers := self.producers()) > 1:
            self._report(f"producers {key}", f"{key}: more than one producer: {', '.join(producers)}")


_KINDS: dict[type[codec.CodecError], str] = {
    codec.WrongType: "wrong_type",
    codec.WrongVersion: "wrong_version",
    codec.Malformed: "malformed",
}
