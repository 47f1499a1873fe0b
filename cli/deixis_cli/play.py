"""Plays a source through the stages of this host and gathers what they answer: the core of run, eval and benchmarks."""

from __future__ import annotations

import logging
import time
from collections import Counter, deque
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import zenoh
from deixis_runtime.host import SOURCE, Host, HostFailed, HostOptions
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.session import Unreachable, first_line
from deixis_schemas import codec, topics
from deixis_schemas.messages import CameraInfo, Health, Message, OfFrame, State, Target

from .frame_tally import FrameTally
from .gets import TIMEOUT_S, get_healths, get_names, get_raw, get_state
from .inbox import Inbox, Received
from .mcap_file import McapFileError, McapRecorder
from .play_end import PlayEnd
from .raw_message import RawMessage
from .recorder import Recorder, RecorderError
from .shown import Show

log = logging.getLogger("deixis-play")

TURN_S = 0.05
SETTLE_S = 4.0
STOPPED_ANSWER_S = 0.2
MAX_TARGETS = 1000

OnMessage = Callable[[str, Message], None]
Beside = Callable[[zenoh.Session], AbstractContextManager[object]]


@dataclass
class PlayResult:
    """What came out of a run.

    frames: that the camera gave. targets: the final ones, the last 1000. health: the last record of each stage. counters:
    messages by type under their names; `rejected` (broke the contract), `lost` (we were too slow), `unanswered` (stages that
    did not answer the last frame). names: of the POIs by id. failure: why it did not do its job, or none. signal: of the
    interrupt, or none.
    """

    frames: int = 0
    targets: list[Target] = field(default_factory=list)
    health: dict[str, Health] = field(default_factory=dict)
    counters: dict[str, int] = field(default_factory=dict)
    camera: CameraInfo | None = None
    state: State | None = None
    names: dict[str, str] = field(default_factory=dict)
    failure: str | None = None
    signal: int | None = None
    wall_s: float = 0.0


def play(
    options: HostOptions,
    *,
    out: Path | None = None,
    mcap: Path | None = None,
    pictures: bool = False,
    name: str = "run",
    on_message: OnMessage | None = None,
    beside: Beside | None = None,
    show: Show | None = None,
    timeout_s: float | None = None,
) -> PlayResult:
    """Start the host's stages, play the source of the camera's settings to its end, and stop them.

    `out` is the folder that gets `NAME.jsonl`; `mcap` a file that gets all as it was sent, frames with `pictures` only, and
    what `show` makes of it for others to look at.
    `on_message` is called in this thread with (key, message) for each message,
    frames without image bytes. `beside` is entered with the run's session when all stages but the source are ready, and left
    at the end: for those who have something to say in the run themselves. Ends when the source has ended and is answered, has
    failed, on SIGINT or SIGTERM, or after `timeout_s` seconds; a live or looping source has no other end. Never raises for
    what the system does: see `failure`.
    """
    began_s = time.monotonic()
    playback = Playback(options, on_message, None if timeout_s is None else began_s + timeout_s)
    playback.beside = beside
    try:
        with ExitStack() as stack:
            if out is not None:
                playback.recorder = stack.enter_context(Recorder(out, name))
            if mcap is not None:
                playback.mcap = stack.enter_context(McapRecorder(mcap, show))
                playback.pictures = pictures
            playback.interrupts = stack.enter_context(Interrupts())
            playback.run(stack.enter_context(Host(options)))
    except (HostFailed, Unreachable, RecorderError, McapFileError) as error:
        playback.result.failure = str(error)
    except zenoh.ZError as error:
        playback.result.failure = f"Zenoh: {first_line(error)}"
    return playback.finish(time.monotonic() - began_s)


class Playback:
    """One run: hears all keys of the robot until the end."""

    def __init__(self, options: HostOptions, on_message: OnMessage | None, deadline_s: float | None) -> None:
        self.result = PlayResult()
        self.recorder: Recorder | None = None
        self.mcap: McapRecorder | None = None
        self.pictures = False
        self.interrupts = Interrupts()
        self.beside: Beside | None = None
        self._options = options
        self._on_message = on_message
        self._deadline_s = deadline_s
        self._inbox = Inbox()
        self._end = PlayEnd(options.stages)
        self._counts: Counter[str] = Counter()
        self._tally = FrameTally()
        # By episode, as sent: 3 kB each. As objects a thousand take ten times that, and a looped clip fills them in an hour.
        self._targets: deque[tuple[str, bytes]] = deque(maxlen=MAX_TARGETS)

    def run(self, host: Host) -> None:
        """From the first process to the last answer. Raises HostFailed, Unreachable, zenoh.ZError, or for a file an OSError."""
        with ExitStack() as stack:

            def listen() -> None:
                subscriber = host.session.declare_subscriber(f"deixis/{self._options.robot}/**", self._inbox.store)
                stack.callback(subscriber.undeclare)
                if self.mcap is not None and topics.POI.stage in self._options.stages:
                    for poi in get_raw(host.session, topics.POI.key(self._options.robot, id="*")):
                        self.mcap.write(poi)  # said before we listened, or in the site file alone
                if self.beside is not None:
                    stack.enter_context(self.beside(host.session))

            host.start(listen, self.interrupts.requested)
            while not self._is_over(host):
                self._turn(host)
            self._settle(host)
            if self.result.failure is None and host.given_up:
                self.result.failure = _said(host.given_up)

    def finish(self, wall_s: float) -> PlayResult:
        """The result, complete."""
        result = self.result
        self._counts["rejected"] = self._inbox.rejected
        self._counts["lost"] = self._inbox.lost
        for key, why in self._inbox.rejections.items():
            log.warning("%s: not recorded: %s", key, why)
        result.frames = self._tally.frames if self._counts["Frame"] else 0
        result.targets = [codec.decode(Target, sent, codec.encoding_of(Target)) for _, sent in self._targets]
        result.counters = dict(self._counts)
        result.camera = self._end.camera
        result.signal = self.interrupts.signal
        result.wall_s = wall_s
        if result.failure is None:
            result.failure = self._broken_off()
        return result

    def _broken_off(self) -> str | None:
        """Why a recording ended before its end, as a truncated file does; none where it did not."""
        health = self.result.health.get(SOURCE)
        return health.reason if self._ended() and health is not None and health.state != "ok" else None

    def _is_over(self, host: Host) -> bool:
        now_s = time.monotonic()
        self.result.failure = self._end.failure()
        if self.result.failure is None and SOURCE in host.given_up:  # without it no frame comes any more
            self.result.failure = _said(host.given_up)
        if self.result.failure is None and self._deadline_s is not None and now_s > self._deadline_s:
            self.result.failure = "the time given to the run is over and the source has not ended"
        return self.result.failure is not None or self.interrupts.requested() or self._end.is_over(now_s)

    def _turn(self, host: Host) -> None:
        self._inbox.wait(TURN_S)
        for raw in self._inbox.take_raw():
            self._keep(raw)
            received = self._inbox.read(raw)
            if received is not None:
                self._take(received)
        host.poll()

    def _keep(self, raw: RawMessage) -> None:
        if self.mcap is not None and (self.pictures or topics.topic_of(raw.key) is not topics.FRAME):
            self.mcap.write(raw)

    def _take(self, received: Received) -> None:
        message = received.message
        if self.recorder is not None:
            self.recorder.write(received)
        self._end.hear(received.topic, message, time.monotonic())
        if message is None:
            return
        self._counts[type(message).__name__] += 1
        if isinstance(message, OfFrame):
            self._tally.note(message.frame_id)
        if isinstance(message, Health) and message.stage != topics.SUPERVISOR:
            self.result.health[message.stage] = message
        if isinstance(message, Target) and message.final:
            self._targets.append((message.episode_id, codec.encode(message)))
        if self._on_message is not None:
            self._on_message(received.key, message)

    def _settle(self, host: Host) -> None:
        """Hear the last targets, and ask the stages once more how they fared."""
        for path in self._end.unanswered() if self._ended() else []:
            self._counts["unanswered"] += 1
            log.warning("%s: the last frame was not answered", path)
        deadline_s = time.monotonic() + SETTLE_S
        # Who told us to stop does not wait for a stage that hangs.
        answer_s = STOPPED_ANSWER_S if self.interrupts.requested() else TIMEOUT_S
        while topics.STATE.stage in self._options.stages:
            self.result.state = state = get_state(host.session, self._options.robot, answer_s) or self.result.state
            self._turn(host)
            if not self._ended() or self._has_all(state) or time.monotonic() > deadline_s:
                break
        if topics.POI.stage in self._options.stages:
            self.result.names = get_names(host.session, self._options.robot, answer_s)
        for health in get_healths(host.session, self._options.robot, answer_s):
            if health.stage != topics.SUPERVISOR:  # it is we, and say in `failure` what is worth saying
                self.result.health[health.stage] = health

    def _ended(self) -> bool:
        return self._end.camera is not None and self._end.camera.state == "ended"

    def _has_all(self, state: State | None) -> bool:
        """Whether no episode is open and the final target of each has been heard."""
        if state is None or state.open_episodes:
            return False
        return {target.episode_id for target in state.recent_targets} <= {episode for episode, _ in self._targets}


def _said(given_up: dict[str, str]) -> str:
    return "; ".join(f"{name} is given up: {why}" for name, why in given_up.items())
