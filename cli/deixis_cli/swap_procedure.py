"""The steps of a hot swap, as one who looks on orders them: `deixis swap` and the benchmark of it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import TypeVar

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import OfFrame, Voice
from deixis_schemas.topics import By, Topic

from .gets import get_all
from .newcomer import GivenNewcomer, Newcomer
from .standby_exam import StandbyExam
from .swap_count import Cost, SwapCount
from .system import alive_processes

START_WITHIN_S = 60.0
EXAM_WITHIN_S = 15.0
TAKE_WITHIN_S = 10.0
"""From the order on, of which the newcomer gives the old one a second and a half to answer."""
HEARD_WITHIN_S = 20.0
"""Until the newcomer's first answer: in lockstep, on a machine that is busy, frames come slowly."""
MUTE_WITHIN_S = 120.0
"""For the operator to end an old stage that does not yield."""
LEAVE_WITHIN_S = 5.0
ASK_WITHIN_S = 1.5
TURN_S = 0.02
LOOK_S = 0.25
TOKENS_WITHIN_S = 2.0
MAX_KEPT = 2048
MAX_KEPT_BYTES = 64 << 20

T = TypeVar("T")


class Refusal(Exception):
    """The swap did not come about, or not as it should; the text says who is heard now, and why."""


class Ear:
    """Keeps what comes on one key, as it was sent, with the time."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self._lock = threading.Lock()
        self._samples: deque[tuple[float, bytes, str]] = deque(maxlen=MAX_KEPT)
        self._bytes = 0
        self._subscriber = session.declare_subscriber(key, self._store)

    def take(self) -> list[tuple[float, bytes, str]]:
        """(monotonic time, payload, encoding) of all that came since the last call."""
        with self._lock:
            taken = list(self._samples)
            self._samples.clear()
            self._bytes = 0
        return taken

    def _store(self, sample: zenoh.Sample) -> None:
        with self._lock:
            if self._bytes < MAX_KEPT_BYTES:
                self._bytes += len(sample.payload)
                self._samples.append((time.monotonic(), sample.payload.to_bytes(), str(sample.encoding)))


class SwapProcedure:
    """One swap of a stage. Its steps raise Refusal; before `hand_over` the old one is heard as if nothing had been."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        stage: str,
        stopped: Callable[[], bool] = lambda: False,
        advise: Callable[[str], None] = lambda _text: None,
    ) -> None:
        """`stopped` says whether to give up waiting; `advise` is told what the operator has to do meanwhile."""
        self._session = session
        self._robot = robot
        self._stage = stage
        self._stopped = stopped
        self._advise = advise
        self._topic = topic_of_stage(stage)
        self._input = input_of_stage(stage)
        self._given = Ear(session, self._input.key(robot))
        self._ear = Ear(session, self._topic.key(robot))
        self._count = SwapCount("", "")
        self._aside = Ear(session, topics.standby_key(self._topic, robot))

    def incumbent(self) -> str:
        """The instance that is heard."""
        heard = sorted(self.heard_now())
        if not heard:
            raise Refusal(
                f"no {self._stage} of robot '{self._robot}' is alive: start it ('deixis up --only {self._stage} ...')"
            )
        if len(heard) > 1:
            raise Refusal(f"{self._stage} has {len(heard)} processes that are heard, {', '.join(heard)}: stop all but one")
        return heard[0]

    def heard_now(self) -> set[str]:
        """Instances of the stage whose token says that they are heard."""
        return {instance for stage, instance in alive_processes(self._session, self._robot) if stage == self._stage}

    def standing_by(self) -> set[str]:
        """Instances of the stage whose token says that they stand by."""
        key = topics.standby_alive_key(self._robot, self._stage, "*")
        replies = self._session.liveliness().get(key, timeout=TOKENS_WITHIN_S)
        return {str(reply.ok.key_expr).split("/")[-2] for reply in replies if reply.ok is not None}

    def await_standing_by(self, newcomer: Newcomer) -> str:
        """The newcomer's instance, once it stands by."""
        old = self.heard_now()
        if newcomer.instance in old:
            raise Refusal(f"{newcomer.instance} is {self._stage} already: --instance names one that stands by for its place")
        before = set() if newcomer.instance or not newcomer.ours else self.standing_by()
        if before:
            raise Refusal(
                f"{', '.join(sorted(before))} stands by for {self._stage} already: name it with --instance, or stop it"
            )

        def found() -> str:
            if intruders := self.heard_now() - old:
                raise Refusal(
                    f"the newcomer {', '.join(sorted(intruders))} does not stand by, it spoke at once: it has to do what "
                    "docs/swap.md says of DEIXIS_STAND_BY"
                )
            standing = self.standing_by()
            return next(iter(standing if newcomer.instance is None else standing & {newcomer.instance}), "")

        who = newcomer.instance or "the newcomer"
        if isinstance(newcomer, GivenNewcomer):
            self._say_if_absent(who)
        elif newcomer.ours:
            whose = f"{self._stage} of robot '{self._robot}'"
            self._advise(f"waiting for the newcomer to stand by for {whose}, {START_WITHIN_S:g} s at most")
        return self._await(found, newcomer, START_WITHIN_S, f"{who} does not stand by", LOOK_S)

    def _say_if_absent(self, instance: str) -> None:
        """A name that is misspelt, or a process that was not started, must not look like a hang."""
        standing = self.standing_by()
        if instance not in standing:
            others = ", ".join(sorted(standing)) or "nobody"
            self._advise(f"{instance} does not stand by for {self._stage} ({others} does); waiting {START_WITHIN_S:g} s for it")

    def examine(self, old: str, new: str, newcomer: Newcomer) -> None:
        """Look at what the newcomer says aside, beside the old one's answers."""
        exam = StandbyExam(self._topic, new)
        self._count = SwapCount(old, new)
        until_s = time.monotonic() + EXAM_WITHIN_S
        while not exam.enough() and time.monotonic() < until_s:
            self._pause(newcomer, TURN_S)
            for message in self._listen():
                if message.instance == old:
                    exam.hear_old(message)
            for _, payload, encoding in self._aside.take():
                exam.hear_new(payload, encoding)
        if verdict := exam.verdict():
            raise Refusal(f"{old} keeps the place, for {new} is not fit for it: {verdict}")

    def hand_over(self, old: str, new: str, newcomer: Newcomer, watch_s: float) -> Cost:
        """Order the newcomer that was examined to take the place, watch it so long, and end the old one. What that has cost."""
        self._order(old, new, newcomer)
        mute = f"{new} has the place and answers no frame; {old} stands by and takes it back when {new} is stopped"
        self._await(self._is_heard, newcomer, HEARD_WITHIN_S, mute)
        until_s = time.monotonic() + watch_s
        while time.monotonic() < until_s:
            self._pause(newcomer, LOOK_S)
            self._listen()
            if new not in self.heard_now():
                raise Refusal(f"{new} took the place and is gone; heard now: {', '.join(self.heard_now()) or 'nobody'}")
        self._dismiss(old, newcomer)
        self._listen()
        cost = self._count.cost()
        if cost is None:
            raise Refusal(f"{old} was not heard before {new}: what the swap has cost is not known")
        return cost

    def _is_heard(self) -> bool:
        """Whether the newcomer has answered a frame aloud."""
        self._listen()
        return self._count.answers_of_new() > 0

    def _order(self, old: str, new: str, newcomer: Newcomer) -> None:
        key = topics.VOICE.key(self._robot, stage=self._stage, id=new)
        until_s = time.monotonic() + TAKE_WITHIN_S
        told, said = self._ask(f"{key}?op=take;from={old}")
        # Silence is no answer: on a machine that is busy one may come late, and the next tells how it stands then.
        while not said and time.monotonic() < until_s:
            if told is not None and told.state == "speaks":
                return
            self._pause(newcomer, TURN_S)
            self._listen()
            told, said = self._ask(key)
            said = said or (told.reason if told is not None and told.state == "stands_by" else "")
        if f"{old} has not answered" in said:
            self._await_end_of_mute(old, new, newcomer)
        elif new not in self.heard_now():
            raise Refusal(f"{old} keeps the place: {said or f'{new} does not answer'}")

    def _await_end_of_mute(self, old: str, new: str, newcomer: Newcomer) -> None:
        """An old stage that knows nothing of changing places, or hangs: the newcomer takes over when it is gone."""
        self._advise(f"{old} does not answer the question for its place: stop it now (SIGTERM), and {new} takes over")

        def taken() -> bool:
            self._listen()
            return new in self.heard_now()

        self._await(taken, newcomer, MUTE_WITHIN_S, f"{old} keeps the place: it does not yield, and it was not stopped", LOOK_S)

    def _dismiss(self, old: str, newcomer: Newcomer) -> None:
        """End the old one, if it is there: it may be one that was stopped."""
        key = topics.VOICE.key(self._robot, stage=self._stage, id=old)
        until_s = time.monotonic() + LEAVE_WITHIN_S
        while old in self.standing_by():
            _, why = self._ask(f"{key}?op=leave")
            if why and time.monotonic() > until_s:
                raise Refusal(f"{old} does not leave: {why}; it stands by, is not heard, and may be stopped")
            if time.monotonic() > until_s:
                raise Refusal(f"{old} does not leave; it stands by, is not heard, and may be stopped")
            self._pause(newcomer, LOOK_S)

    def _ask(self, selector: str) -> tuple[Voice | None, str]:
        """The answer, or why it was refused; neither where nobody answers in time."""
        good, bad = get_all(self._session, selector, Voice, timeout_s=ASK_WITHIN_S)
        return (good[0][1], "") if good else (None, bad[0].reason if bad else "")

    def _listen(self) -> list[OfFrame]:
        """Count what has come since the last call; the answers among it."""
        answers: list[OfFrame] = []
        for _, payload, encoding in self._given.take():
            given = self._read(self._input, payload, encoding)
            if given is not None:
                self._count.give(given.frame_id)
        for at_s, payload, encoding in self._ear.take():
            message = self._read(self._topic, payload, encoding)
            if message is not None:
                self._count.hear(message.frame_id, message.instance, at_s)
                answers.append(message)
        return answers

    def _read(self, topic: Topic, payload: bytes, encoding: str) -> OfFrame | None:
        try:
            message = codec.decode(topic.type, payload, encoding, max_bytes=topic.max_bytes)
        except codec.CodecError:
            return None  # who works on the key counts it and says so
        return message if isinstance(message, OfFrame) else None

    def _await(self, value: Callable[[], T], newcomer: Newcomer, within_s: float, else_say: str, turn_s: float = TURN_S) -> T:
        """The first true value."""
        until_s = time.monotonic() + within_s
        while not (found := value()):
            if time.monotonic() > until_s:
                raise Refusal(f"{else_say} (waited {within_s:g} s)")
            self._pause(newcomer, turn_s)
        return found

    def _pause(self, newcomer: Newcomer, turn_s: float) -> None:
        if self._stopped():
            raise Refusal(f"stopped; heard now: {', '.join(sorted(self.heard_now())) or 'nobody'}")
        if turn_s >= LOOK_S and (ended := newcomer.ended()):
            raise Refusal(f"the newcomer has ended ({ended}); heard now: {', '.join(sorted(self.heard_now())) or 'nobody'}")
        time.sleep(turn_s)


def topic_of_stage(stage: str) -> Topic:
    """What a swappable stage answers each frame on."""
    return next(topic for topic in topics.TOPICS if topic.stage == stage and topic.by is By.FRAME)


def input_of_stage(stage: str) -> Topic:
    """What it works on last of what comes with each frame: with it a frame is given to the stage."""
    return [topic for topic in topics.INPUTS[stage] if topic.by is By.FRAME][-1]
