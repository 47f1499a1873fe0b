"""One ROS 2 node in a Zenoh session of its own: publishers and subscriptions with the tokens by which ROS sees them."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import zenoh
from deixis_runtime.session import Unreachable, first_line, open_client
from deixis_runtime.stage import Node
from zenoh.ext import HistoryConfig, declare_advanced_subscriber

from .attachment import Attachment, BadAttachment
from .config import RosConfig
from .names import (
    Endpoint,
    Kind,
    NodeName,
    Qos,
    dds_type,
    endpoint_token,
    global_id,
    node_token,
    publishers_of,
    read_publisher,
    topic_key,
)
from .ros_types import RosTypes

MAX_KNOWN_PUBLISHERS = 64
STOP_WAIT_S = 3.0


@dataclass(frozen=True)
class Arrived:
    """One message as it came: its bytes, and when by this host's wall clock."""

    payload: bytes
    arrived_ns: int


class Newest:
    """The newest message of a topic; older ones are overwritten, and what is too large is not kept."""

    def __init__(self, type_name: str, topic: str, qos: Qos, max_bytes: int, wake: Callable[[], None]) -> None:
        self.type_name = type_name
        self.topic = topic
        self.qos = qos
        self.received = 0
        self.overwritten = 0
        self.oversized = 0
        self.unattached = 0
        self._max_bytes = max_bytes
        self._wake = wake
        self._lock = threading.Lock()
        self._sample: tuple[zenoh.Sample, int] | None = None

    def store(self, sample: zenoh.Sample) -> None:
        """Callback of the Zenoh subscriber; runs on one of its threads."""
        now_ns = time.time_ns()
        with self._lock:
            self.received += 1
            if len(sample.payload) > self._max_bytes:
                self.oversized += 1
                return
            self.overwritten += self._sample is not None
            self._sample = sample, now_ns
        self._wake()

    def take(self) -> Arrived | None:
        """The newest message not taken yet."""
        with self._lock:
            sample, self._sample = self._sample, None
        if sample is None:
            return None
        self._look_at_attachment(sample[0])
        return Arrived(sample[0].payload.to_bytes(), sample[1])

    def _look_at_attachment(self, sample: zenoh.Sample) -> None:
        """Counted only: the bytes say what they are without it."""
        try:
            Attachment.read(sample.attachment.to_bytes() if sample.attachment is not None else b"")
        except BadAttachment:
            self.unattached += 1


class RosPublisher:
    """Publishes one topic; ROS sees it while this object stands."""

    def __init__(self, session: zenoh.Session, types: RosTypes, key: str, token: str, qos: Qos) -> None:
        self._types = types
        self._global_id = global_id(token)
        self._numbers = itertools.count(1)
        reliability = zenoh.Reliability.RELIABLE if qos.reliable else zenoh.Reliability.BEST_EFFORT
        # DROP, as rmw_zenoh for all but KEEP_ALL: one subscriber that hangs must not hold us.
        self._publisher = session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.DROP, reliability=reliability
        )
        self._token = session.liveliness().declare_token(token)

    def put(self, message: Any) -> None:
        """Publish a message of the topic's type."""
        attachment = Attachment(next(self._numbers), time.time_ns(), self._global_id)
        self._publisher.put(self._types.encode(message), attachment=attachment.encoded())

    def close(self) -> None:
        """Leave the ROS graph."""
        self._token.undeclare()  # type: ignore[no-untyped-call]
        self._publisher.undeclare()  # type: ignore[no-untyped-call]


class RosNode:
    """The node. Subscriptions are told before `start`; publishers come and go while it is linked.

    The session is opened by a thread that tries again until ROS's router is there: the loop of the stage goes on meanwhile.
    """

    def __init__(self, config: RosConfig, name: str, types: RosTypes, wake: Callable[[], None]) -> None:
        self.name = NodeName(config.domain, config.namespace, name)
        self.problem = ""  # until something is known to be wrong
        self._config = config
        self._types = types
        self._wake = wake
        self._inputs: list[Newest] = []
        self._publishers: dict[str, set[Endpoint]] = {}
        self._lock = threading.Lock()
        self._stopped = threading.Event()
        self._session: zenoh.Session | None = None
        self._declared: list[Any] = []  # Zenoh undeclares what is not referenced
        self._numbers = itertools.count(1)
        self._thread = threading.Thread(target=self._link, daemon=True, name="ros-link")

    def subscribe(self, type_name: str, topic: str, qos: Qos, max_bytes: int) -> Newest:
        """Listen to a topic once linked."""
        heard = Newest(type_name, self.name.qualified(topic), qos, max_bytes, self._wake)
        self._inputs.append(heard)
        return heard

    def start(self) -> None:
        """Begin to link to ROS's router."""
        self._thread.start()

    def stop(self) -> None:
        """Leave the ROS graph, and do not try again."""
        self._stopped.set()
        self._thread.join(STOP_WAIT_S)

    @property
    def linked(self) -> bool:
        """Whether ROS's router is there now; `problem` says why not."""
        session = self._session
        return session is not None and next(iter(session.info.routers_zid()), None) is not None

    def publisher(self, type_name: str, topic: str, qos: Qos) -> RosPublisher | None:
        """A publisher; None while ROS was not reached yet."""
        session = self._session
        if session is None:
            return None
        full = self.name.qualified(topic)
        token = self._token(session, "MP", type_name, full, qos)
        return RosPublisher(session, self._types, self._key(type_name, full), token, qos)

    def publishers_of(self, topic: str) -> list[Endpoint]:
        """Who publishes one of the topics that we listen to, whatever its type."""
        with self._lock:
            return sorted(self._publishers.get(topic, ()), key=lambda endpoint: endpoint.node)

    # --- the thread that links ----------------------------------------------------------------------------------------

    def _link(self) -> None:
        while not self._stopped.is_set():
            try:
                # Two sessions in one process: shared memory is for that of Deixis.
                with open_client(self._config.router, shared_memory=False) as session:
                    self._declare(session)
                    self.problem = f"the link to ROS's Zenoh router at {self._config.router} is cut; trying again"
                    self._session = session
                    self._wake()
                    self._stopped.wait()
                    self._session = None
            except (Unreachable, zenoh.ZError) as error:
                self.problem = self._why(error)
                self._wake()
                self._stopped.wait(self._config.retry_s)

    def _why(self, error: Exception) -> str:
        if isinstance(error, zenoh.ZError):
            return f"ROS's Zenoh router at {self._config.router} refused the node: {first_line(error)}"
        finding = error.why if isinstance(error, Unreachable) else None
        said = f" ({finding.what})" if finding is not None else ""
        return (
            f"no Zenoh router of ROS answers at {self._config.router}{said}: start it with "
            "'ros2 run rmw_zenoh_cpp rmw_zenohd', or name another in ros.router"
        )

    def _declare(self, session: zenoh.Session) -> None:
        self._declared = [session.liveliness().declare_token(node_token(str(session.info.zid()), self.name))]
        for heard in self._inputs:
            key = self._key(heard.type_name, heard.topic)
            if heard.qos.transient_local:
                # As rmw_zenoh: what was published before is asked of the publishers, also of those who come later.
                history = HistoryConfig(detect_late_publishers=True, max_samples=heard.qos.depth)
                self._declared.append(declare_advanced_subscriber(session, key, heard.store, history=history))
            else:
                self._declared.append(session.declare_subscriber(key, heard.store))
            token = self._token(session, "MS", heard.type_name, heard.topic, heard.qos)
            self._declared.append(session.liveliness().declare_token(token))
            expression = publishers_of(self.name.domain, heard.topic)
            self._declared.append(session.liveliness().declare_subscriber(expression, self._note_publisher, history=True))

    def _note_publisher(self, sample: zenoh.Sample) -> None:
        """Callback of the liveliness subscriber; runs on one of Zenoh's threads."""
        endpoint = read_publisher(str(sample.key_expr))
        if endpoint is None:
            return
        with self._lock:
            known = self._publishers.setdefault(endpoint.topic, set())
            if sample.kind == zenoh.SampleKind.DELETE:
                known.discard(endpoint)
            elif len(known) < MAX_KNOWN_PUBLISHERS:
                known.add(endpoint)
        self._wake()

    def _key(self, type_name: str, topic: str) -> str:
        return topic_key(self.name.domain, topic, type_name, self._types.hash_of(type_name))

    def _token(self, session: zenoh.Session, kind: Kind, type_name: str, topic: str, qos: Qos) -> str:
        endpoint = Endpoint(self.name.name, topic, dds_type(type_name), self._types.hash_of(type_name))
        return endpoint_token(str(session.info.zid()), next(self._numbers), kind, self.name, endpoint, qos)


def run_linked(ros: RosNode, node: Node, step: Callable[[], None], longest_wait_s: float) -> None:
    """The loop of a bridge: its steps until shutdown, linked to ROS as far as its router is there."""
    ros.start()
    try:
        while node.wait(longest_wait_s):
            step()
    finally:
        ros.stop()
