"""The thin shell that every stage runs in: session, loop, health, signals."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health, HealthState, Message, Producer
from deixis_schemas.topics import Topic

from .certificates import certificates_of
from .clock_watch import ClockWatch
from .delivery import PROFILES
from .handover import Handover
from .heartbeat import Heartbeat
from .inputs import Subscription
from .limit import RateLimit
from .link_watch import CertificateWatch, say
from .liveliness import AliveStages
from .manager import Manager, Unheard
from .memory import settle
from .outputs import Publisher, oversize
from .parent import Parent
from .patient_puts import PatientPuts
from .queries import Answer, EditQueue, Query, QueryQueue
from .readers import Readers
from .session import Unreachable, exit_now, first_line, open_client
from .settings import CommonOptions, ConfigError, StageConfig, load_config, parse_options
from .socket_folder import remove_socket_folder
from .versions import distribution_of

C = TypeVar("C", bound=StageConfig)

EXIT_CONFIG = 78
EXIT_UNREACHABLE = 69
EXIT_REPLACED = 79  # told to its supervisor, who is not to start it again while another has its place
IDLE_WAIT_S = 0.25
# A signal handler may set a plain attribute only (`threading.Event.set` can deadlock in one): `wait` looks this often.
STOP_POLL_S = 0.1
TOKENS_WITHIN_S = 1.0
ANSWERING_S = 0.01
# Who looks on through a new router hears of us when it has its subscriptions, too, and not a whole period later.
LINK_SETTLES_S = 0.25
MAX_COUNTERS = 60  # of the stage; health has room for ours besides


class Node:
    """What a stage's `serve` function works with. One per process; not for use from other threads unless said."""

    def __init__(
        self, session: zenoh.Session, stage: str, options: CommonOptions, *, is_stage: bool = True, distribution: str = ""
    ) -> None:
        """`is_stage`: a robot has one process of this name, and it is said where there are more; its state is logged.

        `distribution`: what the process is made by, `deixis-STAGE` if nothing is said.
        """
        self.producer = Producer(stage, options.instance)
        self.robot = options.robot
        self.site = options.site
        self.lockstep = options.lockstep
        self.started_before = options.started_before
        self.log = logging.getLogger(f"deixis-{stage}")
        self.stopping = False
        self.replaced = False
        self._session = session
        self._endpoint = options.connect
        self._parent = Parent(os.environ) if options.supervised else None
        self._manager = Manager(os.environ)
        self._event = threading.Event()
        self._limit = RateLimit()
        self._logged_state: HealthState = "ok"
        self._linked_to = ""
        self._heartbeat = Heartbeat(self.producer, distribution or f"deixis-{stage}")
        self._patient_puts = PatientPuts(self._go_on) if options.lockstep else None
        self._inputs: list[Subscription] = []
        self._outputs: list[Publisher] = []
        self._queries: list[QueryQueue] = []
        self._edits: list[EditQueue] = []
        self._clocks: list[ClockWatch] = []
        self._clock_of_frames: ClockWatch | None = None  # for ages only; said by who is asked to follow it
        certificates = certificates_of()
        self._certificate = CertificateWatch(certificates) if certificates is not None else None
        self._declared: list[Any] = []  # Zenoh undeclares what is not referenced
        self._alive = AliveStages(session, self.robot, self.wake)
        self._is_stage = is_stage
        self._supervised = options.supervised
        self._handover: Handover | None = None
        if is_stage and stage in topics.SWAPPABLE:
            self._handover = Handover(session, self.robot, self.producer, self._alive, self.wake, standing_by=options.stand_by)
            self.serve_get(topics.VOICE, self._answer_voice, stage=stage, id=options.instance)
        self._doubles: set[str] = set()
        self._token: Any = None
        self._health = self.publish(topics.HEALTH)
        self.serve_get(topics.HEALTH, self._answer_health, stage=stage)

    # --- keys ---------------------------------------------------------------------------------------------------------

    def subscribe(self, topic: Topic, depth: int = 1) -> Subscription[Any]:
        """Listen to a topic and keep its newest `depth` samples."""
        key = topic.key(self.robot)
        clock = self._frames_clock() if topic is topics.FRAME else None
        subscription: Subscription[Any] = Subscription(
            topic, key, depth, self.wake, self.warn, lockstep=self.lockstep, clock=clock
        )
        self._declared.append(self._session.declare_subscriber(key, subscription.store))
        self._inputs.append(subscription)
        return subscription

    def subscribe_edits(self, key: str) -> EditQueue:
        """Listen to puts and deletes on a key expression, each of which counts."""
        queue = EditQueue(key, self.wake, self.warn)
        self._declared.append(self._session.declare_subscriber(key, queue.store))
        self._edits.append(queue)
        return queue

    def publish(self, topic: Topic) -> Publisher:
        """A publisher of a topic of this stage."""
        key = topic.key(self.robot, stage=self.producer.stage)
        by_frame = self._handover is not None and topic.by is topics.By.FRAME
        aside = self._handover.aside(topic, self.monotonic_s) if self._handover is not None and by_frame else None
        publisher = Publisher(
            self._session, topic, key, self.warn, lossless=self.lockstep, patient_puts=self._patient_puts, aside=aside
        )
        self._outputs.append(publisher)
        return publisher

    def announce(self, topic: Topic, message: Message | None, **parts: str) -> None:
        """Publish what this stage keeps under a key of its own, or with None that it is gone; not heard by this process."""
        key, profile = topic.key(self.robot, **parts), PROFILES[topic.delivery]
        remote = zenoh.Locality.REMOTE
        if message is None:
            self._session.delete(key, priority=profile.priority, express=profile.express, allowed_destination=remote)
            return
        payload = codec.encode(message)
        if len(payload) > topic.max_bytes:
            self.count("announcements_oversized")
            self.warn(f"size {key}", f"{key}: not published: {oversize(len(payload), topic)}")
            return
        self._session.put(
            key,
            payload,
            encoding=codec.encoding_of(type(message)),
            priority=profile.priority,
            express=profile.express,
            allowed_destination=remote,
        )

    def serve_get(self, topic: Topic, answer: Answer, **parts: str) -> None:
        """Answer gets on a topic, or `parts` of it (`id="**"`); `answer` is called in the loop, from `wait`.

        A reply that is larger than the topic allows becomes an error that says so.
        """
        queue = QueryQueue(topic, answer, self.wake, self.warn)
        self._declared.append(self._session.declare_queryable(topic.key(self.robot, **parts), queue.store))
        self._queries.append(queue)

    def follow_clock(self, stage: str) -> ClockWatch:
        """Compare the clock of this stage's host with ours from now on; said in health, and warned of where they differ."""
        watch = ClockWatch(self._session, self.robot, stage)
        self._clocks.append(watch)
        return watch

    def follow_readers(self, topic: Topic) -> Readers:
        """Find out, again and again, whether those who listen to a topic are on this host; call its `turn` in the loop."""
        return Readers(self._session, self.robot, topic, self.producer, self._alive, self._router)

    def alive_processes(self) -> set[tuple[str, str]]:
        """(stage, instance) of those whose token stands."""
        return self._alive.processes()

    def alive_stages(self) -> set[str]:
        """Stages with a process whose liveliness token stands. A hung process keeps its token; health tells."""
        return self._alive.stages()

    # --- loop ---------------------------------------------------------------------------------------------------------

    def wait(self, timeout_s: float = IDLE_WAIT_S) -> bool:
        """Wait for input, at most `timeout_s` and often less; answer gets and send the heartbeat. False: stop the stage."""
        if self._token is None:
            self._declare_alive()
        self._look_at_link()
        self._event.wait(min(timeout_s, self._heartbeat.due_in_s(), STOP_POLL_S))
        self._event.clear()
        # A flood of gets takes this much of each turn, and the stage's own work the rest.
        answer_until_s = time.monotonic() + ANSWERING_S
        if any([queue.answer_until(answer_until_s) for queue in self._queries]):  # noqa: C419 - each has its turn
            self.wake()
        self._turn_handover()
        if self._heartbeat.due_in_s() == 0.0:
            self._beat()
        return self._go_on()

    def wake(self) -> None:
        """Make `wait` return; may be called from any thread."""
        self._event.set()

    def stop(self) -> None:
        """Make the stage stop within STOP_POLL_S; may be called from any thread and from a signal handler."""
        self.stopping = True

    @contextmanager
    def step(self) -> Iterator[None]:
        """Time one step of the stage for its health record."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self._heartbeat.step_took(time.perf_counter() - began)

    def now_ns(self) -> int:
        """Wall clock, Unix nanoseconds."""
        return time.time_ns()

    def monotonic_s(self) -> float:
        """Clock for intervals on this host, seconds."""
        return time.monotonic()

    # --- what the stage says of itself --------------------------------------------------------------------------------

    def warn(self, kind: str, text: str) -> None:
        """Log a warning, at most one line per kind and 10 seconds."""
        left_out = self._limit.allow(kind, time.monotonic())
        if left_out is not None:
            self.log.warning("%s%s", text, f" ({left_out} more like it)" if left_out else "")

    def count(self, name: str, n: int = 1) -> None:
        """Advance a counter of the health record."""
        counters = self._heartbeat.counters
        if name in counters or len(counters) < MAX_COUNTERS:
            counters[name] = counters.get(name, 0) + n

    def count_to(self, name: str, total: int) -> None:
        """Bring a counter of the health record up to what was counted elsewhere."""
        self.count(name, total - self._heartbeat.counters.get(name, 0))

    def set_state(self, state: HealthState, reason: str = "") -> None:
        """Say in health whether the stage does its work, and log it where that changes."""
        self._heartbeat.state, self._heartbeat.reason = state, reason
        self._log_state()

    def note(self, key: str, text: str | None) -> None:
        """Show a condition in health, or take it back with None."""
        if text is None:
            self._heartbeat.notes.pop(key, None)
        else:
            self._heartbeat.notes[key] = text[:2000]

    # --- inside -------------------------------------------------------------------------------------------------------

    def _log_state(self) -> None:
        # By state, not by reason: a reason that counts seconds would be a line each step. A state that comes and goes is
        # limited, too; the heartbeat then says later where it has come to rest.
        state, reason = self._heartbeat.state, self._heartbeat.reason
        if not self._is_stage or state == self._logged_state or self._limit.allow(f"state {state}", time.monotonic()) is None:
            return
        self._logged_state = state
        self.log.log(logging.INFO if state == "ok" else logging.WARNING, "%s%s", state, f": {reason}" if reason else "")

    def _beat(self) -> None:
        self._heartbeat.beat()
        self._log_state()
        self._look_at_queues()
        self._look_at_clocks()
        self._look_at_certificate()
        if self._is_stage:
            self._look_at_doubles()
        self._health.put(self._record())
        if not self._router():
            self.warn("router", f"no link to the Zenoh router at {self._endpoint}; trying again")

    def _look_at_link(self) -> None:
        router = self._router()
        if router and router != self._linked_to:
            self._heartbeat.hasten(LINK_SETTLES_S)
        self._linked_to = router

    def _go_on(self) -> bool:
        """Give a sign that the loop runs, and say whether it is to go on."""
        self._tell_manager()
        if self._parent is not None and self._parent.gone():
            self.log.error("the supervisor is gone; stopping")
            remove_socket_folder(self._endpoint)
            self.stop()
        if self.stopping:
            self._manager.leave()
        return not self.stopping

    def _tell_manager(self) -> None:
        heartbeat = self._heartbeat
        status = f"{heartbeat.state}: {heartbeat.reason}" if heartbeat.reason else heartbeat.state
        try:
            self._manager.tell(time.monotonic(), status)
        except Unheard as error:
            self.warn("manager", str(error))

    def _answer_health(self, _query: Query) -> list[tuple[str, Message]]:
        return [(self._health.key, self._record())]

    def _record(self) -> Health:
        clocks = [known for watch in self._clocks if (known := watch.health()) is not None]
        standing_by = self._handover is not None and not self._handover.heard
        return self._heartbeat.record(
            self.now_ns(), self._inputs, self._outputs, clocks, self._router(), standing_by=standing_by
        )

    def _router(self) -> str:
        """Zenoh id of the router we are a client of; empty without one."""
        return next(map(str, self._session.info.routers_zid()), "")

    def _declare_alive(self) -> None:
        settle()
        # Only now, when all subscribers stand: whoever waits for the token may publish at once.
        if self._handover is None:
            self._token = self._session.liveliness().declare_token(topics.alive_key(self.robot, *self.producer))
        else:
            self._token = self._handover
            if self.started_before and self._supervised and self._is_replaced():
                return
            self._handover.declare()
        if self._is_stage:
            waits = "" if self._handover is None or self._handover.heard else ", standing by"
            self.log.info("ready as %s on robot %s%s", self.producer.instance, self.robot, waits)

    def _is_replaced(self) -> bool:
        """Whether another has got the place of the process that was here before: then this one is not needed."""
        mine = topics.alive_key(self.robot, self.producer.stage, "*")
        others = [str(reply.ok.key_expr) for reply in self._session.liveliness().get(mine, timeout=TOKENS_WITHIN_S) if reply.ok]
        if others:
            self.log.info("%s has the place of the process that was here before", others[0].split("/")[-1])
            self.replaced = True
            self.stop()
        return self.replaced

    def _turn_handover(self) -> None:
        if self._handover is None:
            return
        said = self._handover.turn(self.monotonic_s(), self._router())
        if said:
            self.log.warning("%s", said)
            self._heartbeat.hasten(0.0)
        if self._handover.leaving and not self.replaced:
            self.log.info("%s has taken the place; leaving", self._handover.part.other)
            self.replaced = True
            self.stop()

    def _answer_voice(self, query: Query) -> list[tuple[str, Message]]:
        assert self._handover is not None
        return self._handover.answer(query, self.monotonic_s(), self.now_ns())

    def _frames_clock(self) -> ClockWatch | None:
        if self._clock_of_frames is None and not self.lockstep:
            self._clock_of_frames = ClockWatch(self._session, self.robot, topics.FRAME.stage)
        return self._clock_of_frames

    def _look_at_doubles(self) -> None:
        # At the second look only: the token of a predecessor that was killed may stand for a moment.
        if self._handover is not None and not self._handover.heard:
            self._doubles = set()
            self.note("doubles", None)
            return
        alive = {instance for stage, instance in self._alive.processes() if stage == self.producer.stage}
        doubles, before = alive - {self.producer.instance}, self._doubles
        self._doubles = doubles
        stage, who = self.producer.stage, ", ".join(sorted(doubles & before))
        text = f"{who} is {stage} of robot {self.robot}, too: what both publish is mixed; stop one of them" if who else None
        self.note("doubles", text)
        if text:
            self.warn("doubles", text)

    def _look_at_clocks(self) -> None:
        if self._clock_of_frames is not None:
            self._clock_of_frames.turn()
        for watch in self._clocks:
            watch.turn()
            complaint = watch.complaint()
            self.note(f"clock {watch.stage}", complaint)
            if complaint:
                self.warn(f"clock {watch.stage}", f"{watch.key}: {complaint}; run NTP or chrony on both")

    def _look_at_certificate(self) -> None:
        """That of this host, which its router uses: the router itself has no health to say it in."""
        if self._certificate is None:
            return
        found = self._certificate.turn(time.monotonic(), time.time())
        self.note("certificate", self._certificate.complaint)
        if found is not None:
            self.warn("certificate", say(found))

    def _look_at_queues(self) -> None:
        """What was lost or dropped before the stage saw it is said in health."""
        for name, lost in (
            ("edits_lost", sum(queue.lost for queue in self._edits)),
            ("gets_lost", sum(queue.lost for queue in self._queries)),
        ):
            if lost:
                self._heartbeat.counters[name] = lost
        for item in self._inputs:
            late = item.all_too_old()
            self.note(f"age {item.key}", f"{item.key}: all that comes is too old and is dropped" if late else None)


def run_stage(
    stage: str, model: type[C], serve: Callable[[Node, C], None], argv: list[str] | None = None, description: str | None = None
) -> int:
    """Run one stage as this process: read settings, open the session, serve until told to stop.

    Returns the exit status: 0 when told to stop, 78 for bad settings, 69 without a router, 1 for a fault of our own. Does
    not return when a session is open that will not close: then the process ends here.
    """
    setup_logging()
    log = logging.getLogger(f"deixis-{stage}")
    try:
        options = parse_options(stage, description or f"Deixis {stage} stage", argv)
        config = load_config(stage, model, options)
    except ConfigError as error:
        log.error("%s", error)
        return EXIT_CONFIG
    try:
        # On a starved machine Zenoh's watchdog takes a shared buffer back before all have read it: a frame lost in seven
        # hundred or so. Live, the next one makes up for it; in lockstep two runs would differ.
        with open_client(options.connect, shared_memory=not options.lockstep) as session:
            replaced = _serve(session, stage, options, config, serve)
    except ConfigError as error:
        log.error("%s", error)
        exit_now(EXIT_CONFIG)
    except Unreachable as error:
        log.error("%s", error)
        return EXIT_UNREACHABLE
    except Exception:
        log.exception("stopped by a fault")
        exit_now(1)
    log.info("stopped")
    # To systemd it is an end in good order, after which nothing is started again; a supervisor starts again whatever ends.
    exit_now(EXIT_REPLACED if replaced and options.supervised else 0)
    return 0


def setup_logging() -> None:
    """Log to standard error, one line per message."""
    level = os.environ.get("DEIXIS_LOG", "INFO").upper()
    logging.basicConfig(
        level=level if level in logging.getLevelNamesMapping() else "INFO",
        format="%(asctime)s %(name)s %(levelname)s %(message)s",
        datefmt="%H:%M:%S",
        stream=sys.stderr,
    )


def _serve(session: zenoh.Session, stage: str, options: CommonOptions, config: C, serve: Callable[[Node, C], None]) -> bool:
    """Whether the stage has ended because another process has its place."""
    try:
        node = Node(session, stage, options, distribution=distribution_of(serve.__module__))
    except zenoh.ZError as error:
        raise Unreachable(f"the router at {options.connect} refused the stage: {first_line(error)}") from None
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: node.stop())
    serve(node, config)
    return node.replaced
