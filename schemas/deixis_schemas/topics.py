"""The topic table: every key of Deixis with its type, rate and delivery. All else (publishers, health, recorder, docs,
conformance) is derived from it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

from . import messages as m


class Delivery(Enum):
    """How a topic is delivered, named for its stance; what each is in Zenoh says SENT."""

    BULK_NEWEST = "bulk, newest wins: frames; dropped first when the link is full"
    NEWEST = "newest wins: small and perishable; dropped when late"
    KEEP = "keep: few, and the last one is answered to a get"
    KEEP_URGENT = "keep, high priority: answers that people wait for"
    REPLY = "reply: answered to a get only"


@dataclass(frozen=True)
class Sent:
    """What a stance is in Zenoh. priority: by its name there. express: sent at once, not gathered into batches."""

    priority: str
    express: bool


# All drop rather than block: one frozen subscriber of a blocking publisher holds put for 5 s, loses its link and starves
# the healthy ones. What has to last ("keep") is held by its producer and answered to a get.
SENT: dict[Delivery, Sent] = {
    Delivery.BULK_NEWEST: Sent("DATA_LOW", express=False),
    Delivery.NEWEST: Sent("DATA_HIGH", express=True),
    Delivery.KEEP: Sent("INTERACTIVE_HIGH", express=True),
    Delivery.KEEP_URGENT: Sent("INTERACTIVE_HIGH", express=True),
    Delivery.REPLY: Sent("INTERACTIVE_HIGH", express=True),
}


class By(Enum):
    """When a topic is published."""

    FRAME = "each frame"
    CHANGE = "on change"
    EPISODE = "each update of a pointing episode"
    RATE = "at its rate"
    GET = "by get only"


@dataclass(frozen=True)
class Topic:
    """One row of the table. `path` follows `deixis/{robot}/`; `{stage}` and `{id}` in it are filled in by `key`.

    `max_bytes` bounds the payload, also of a reply to a get. `max_age_s`: older ones are dropped by those who listen.
    `silence`: what it means when nothing comes, as one sentence.
    """

    path: str
    type: type[m.Message]
    by: By
    rate_hz: float | None
    delivery: Delivery
    queryable: bool = False
    max_bytes: int = 1 << 20
    max_age_s: float | None = None
    silence: str = ""

    @property
    def version(self) -> int:
        """Version of the payload."""
        return self.type.VERSION

    @property
    def stage(self) -> str:
        """The stage that publishes it; `{stage}` where every stage does."""
        return self.path.split("/", 1)[0]

    def key(self, robot: str, **parts: str) -> str:
        """Key expression of the topic for one robot, e.g. `FRAME.key('r1')` or `HEALTH.key('r1', stage='*')`."""
        return f"deixis/{robot}/{self.path.format(**parts)}"


# A link that was cut gives out what it held back, seconds late, when it is mended.
MAX_AGE_S = 1.0

FRAME = Topic(
    "camera/frame",
    m.Frame,
    By.FRAME,
    30.0,
    Delivery.BULK_NEWEST,
    max_bytes=128 << 20,
    max_age_s=MAX_AGE_S,
    silence="No picture: the source ended, failed or stalled, as `camera/info` says; or the camera and its token are gone.",
)
CAMERA_INFO = Topic(
    "camera/info",
    m.CameraInfo,
    By.CHANGE,
    None,
    Delivery.KEEP,
    queryable=True,
    silence="Nothing has changed since the last one; who has none yet asks by get.",
)
TRACKS = Topic(
    "tracker/tracks",
    m.Tracks,
    By.FRAME,
    30.0,
    Delivery.NEWEST,
    max_age_s=MAX_AGE_S,
    silence="The tracker had no time for that frame, or is gone. A frame with nobody in it is answered by an empty list.",
)
HEAD_POSES = Topic(
    "headpose/poses",
    m.HeadPoses,
    By.FRAME,
    30.0,
    Delivery.NEWEST,
    max_age_s=MAX_AGE_S,
    silence="As of tracks: fusion waits for its age limit, and then decides without heads and says so.",
)
GESTURES = Topic(
    "gesture/gestures",
    m.Gestures,
    By.FRAME,
    30.0,
    Delivery.NEWEST,
    max_age_s=MAX_AGE_S,
    silence="As of tracks: fusion waits for its age limit, and then decides without gestures and says so.",
)
BELIEF = Topic(
    "fusion/belief",
    m.Belief,
    By.FRAME,
    30.0,
    Delivery.NEWEST,
    max_age_s=MAX_AGE_S,
    silence="No tracks came: nobody looks at pictures, or fusion is gone. Nobody in sight is a belief without persons.",
)
TARGET = Topic(
    "fusion/target",
    m.Target,
    By.EPISODE,
    None,
    Delivery.KEEP_URGENT,
    silence="Nobody points. Each pointing gesture ends with one target that says `final`, also where it abstains.",
)
STATE = Topic(
    "fusion/state",
    m.State,
    By.GET,
    None,
    Delivery.REPLY,
    queryable=True,
    max_bytes=4 << 20,
    silence="No reply: fusion is gone, or access control denies the get.",
)
POI = Topic(
    "fusion/poi/{id}",
    m.Poi,
    By.CHANGE,
    None,
    Delivery.KEEP,
    queryable=True,
    max_bytes=64 << 10,
    silence="No edit. No reply to a get: no such POI, or fusion is gone; `fusion/state` tells which.",
)
ROBOT_POSE = Topic(
    "robot/pose",
    m.RobotPose,
    By.RATE,
    None,
    Delivery.NEWEST,
    silence="The robot stands where the last one, or the site file, says.",
)
HEALTH = Topic(
    "{stage}/health",
    m.Health,
    By.RATE,
    1.0,
    Delivery.KEEP,
    queryable=True,
    silence="For 3 s: the process is hung or gone; its liveliness token tells which.",
)

VOICE = Topic(
    "{stage}/voice/{id}",
    m.Voice,
    By.GET,
    None,
    Delivery.REPLY,
    queryable=True,
    max_bytes=64 << 10,
    silence="No reply: that process is gone or knows nothing of changing places, or access control denies the get.",
)

TOPICS: tuple[Topic, ...] = (
    FRAME, CAMERA_INFO, TRACKS, HEAD_POSES, GESTURES, BELIEF, TARGET, STATE, POI, ROBOT_POSE, HEALTH, VOICE,
)  # fmt: skip

# The stages that every frame passes, in their order: a row of the table makes one.
STAGES = tuple(dict.fromkeys(topic.stage for topic in TOPICS if topic.by is By.FRAME))

INPUTS: dict[str, tuple[Topic, ...]] = {
    "camera": (),
    "tracker": (FRAME,),
    "headpose": (FRAME, CAMERA_INFO, TRACKS),
    "gesture": (CAMERA_INFO, TRACKS),
    "fusion": (CAMERA_INFO, ROBOT_POSE, POI, TRACKS, HEAD_POSES, GESTURES),
}
"""What each stage works on; those about frames in the order in which they come."""

SWAPPABLE = tuple(topic.stage for topic in (TRACKS, HEAD_POSES, GESTURES))
"""Stages of which two processes can change places between two frames: their answers are named by the camera's `run` and `seq`,
and they keep nothing that lasts. A camera has a device and a `run` of its own, fusion the registry and open episodes."""

SUPERVISOR = "supervisor"
"""The name, in place of a stage's, of the process that starts a host's stages: its health says how they fare."""


def alive_key(robot: str, stage: str, instance: str) -> str:
    """Liveliness token of one process of a stage."""
    return f"deixis/{robot}/@alive/{stage}/{instance}"


def standby_alive_key(robot: str, stage: str, instance: str) -> str:
    """Liveliness token of a process that stands by: it works, and is not heard yet or no more."""
    return f"{alive_key(robot, stage, instance)}/standby"


def standby_key(topic: Topic, robot: str) -> str:
    """Where a process that stands by says what it would answer on the topic; no wildcard of a listener takes it in."""
    stage, name = topic.path.split("/")
    return f"deixis/{robot}/@standby/{stage}/{name}"


def is_name(text: str) -> bool:
    """Whether it can be one part of a key: a robot, an instance, a POI's id."""
    return re.fullmatch(m.NAME_PATTERN, text) is not None


def topic_of(key: str) -> Topic | None:
    """The row that a concrete key (or one with the robot's part) belongs to; None for a key outside the contract."""
    parts = key.split("/")
    if len(parts) < 4 or parts[0] != "deixis":
        return None
    for topic in TOPICS:
        pattern = topic.path.split("/")
        if len(pattern) == len(parts) - 2 and all(
            p.startswith("{") or p == given for p, given in zip(pattern, parts[2:], strict=True)
        ):
            return topic
    return None
