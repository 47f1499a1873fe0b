"""Names as rmw_zenoh makes them: keys of topics, liveliness tokens, global ids. Pure.

By `docs/design.md` and `liveliness_utils.cpp` of github.com/ros2/rmw_zenoh (humble to lyrical, all on Zenoh 1.x).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import xxhash

Kind = Literal["MP", "MS"]
"""A publisher of messages, or a subscription to them."""

DEFAULT_DEPTH = 42
"""The history that rmw_zenoh leaves out of a token."""
PARTS_OF_TOKEN = 13
TOPIC_PATTERN = r"^/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$"
NAMESPACE_PATTERN = r"^/([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?$"


@dataclass(frozen=True)
class Qos:
    """Quality of service, as far as rmw_zenoh makes a difference; the last `depth` messages are kept."""

    reliable: bool = True
    transient_local: bool = False
    depth: int = 10

    @property
    def token_part(self) -> str:
        """As it stands at the end of a token: what is not rmw_zenoh's default, by the numbers of `rmw/types.h`."""
        reliability, durability = "" if self.reliable else "2", "1" if self.transient_local else ""
        depth = "" if self.depth == DEFAULT_DEPTH else str(self.depth)
        return f"{reliability}:{durability}:,{depth}:,:,:,,"


@dataclass(frozen=True)
class NodeName:
    """A ROS node: `namespace` begins with '/', and is '/' where there is none."""

    domain: int
    namespace: str
    name: str

    def qualified(self, topic: str) -> str:
        """The full name of a topic that this node calls so: relative names lie in its namespace."""
        return topic if topic.startswith("/") else f"{self.namespace.rstrip('/')}/{topic}"


@dataclass(frozen=True)
class Endpoint:
    """Somebody who publishes a topic or listens to it: full name of the topic, type as DDS names it, and the type's hash."""

    node: str
    topic: str
    dds_type: str
    type_hash: str


def dds_type(type_name: str) -> str:
    """The name of a message type on the wire: `std_msgs/msg/String` is `std_msgs::msg::dds_::String_`."""
    package, folder, name = type_name.split("/")
    return f"{package}::{folder}::dds_::{name}_"


def topic_key(domain: int, topic: str, type_name: str, type_hash: str) -> str:
    """Key of a topic, given by its full name."""
    return f"{domain}/{topic.strip('/')}/{dds_type(type_name)}/{type_hash}"


def node_token(session_id: str, node: NodeName) -> str:
    """Liveliness token of a node; we have one node in a session, number 0."""
    return f"@ros2_lv/{node.domain}/{session_id}/0/0/NN/%/{_mangled(node.namespace)}/{node.name}"


def endpoint_token(session_id: str, number: int, kind: Kind, node: NodeName, endpoint: Endpoint, qos: Qos) -> str:
    """Liveliness token of a publisher or subscription, the `number`th entity of the session."""
    who = f"@ros2_lv/{node.domain}/{session_id}/0/{number}/{kind}/%/{_mangled(node.namespace)}/{node.name}"
    return f"{who}/{_mangled(endpoint.topic)}/{endpoint.dds_type}/{endpoint.type_hash}/{qos.token_part}"


def publishers_of(domain: int, topic: str) -> str:
    """Key expression of the tokens of all who publish a topic, whatever its type; `**`: lyrical appends a part."""
    return f"@ros2_lv/{domain}/*/*/*/MP/*/*/*/{_mangled(topic)}/*/*/**"


def read_publisher(token: str) -> Endpoint | None:
    """Whom a token tells of; None where it is not that of a publisher."""
    parts = token.split("/")
    if len(parts) < PARTS_OF_TOKEN or parts[0] != "@ros2_lv" or parts[5] != "MP":
        return None
    namespace, name, topic, type_name, type_hash = parts[7:12]
    node = f"{namespace.replace('%', '/').rstrip('/')}/{name}"
    return Endpoint(node, topic.replace("%", "/"), type_name, type_hash)


def global_id(token: str) -> bytes:
    """The 16 bytes by which an endpoint is known: XXH3-128 of its token, low half first, each little-endian."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")


def node_name(robot: str, part: str) -> str:
    """Name of the node that speaks for a robot: ROS takes letters, digits and '_'."""
    return re.sub("[^A-Za-z0-9_]", "_", f"deixis_{robot}_{part}")


def camera_info_beside(image: str) -> str:
    """The topic of the lens of these pictures, as image_transport places it, also where they are compressed."""
    return f"{image.removesuffix('/compressed').rsplit('/', 1)[0]}/camera_info"


def is_topic(name: str) -> bool:
    """Whether ROS takes this as the name of a topic, relative or full."""
    return re.fullmatch(TOPIC_PATTERN, name) is not None and len(name) <= 255


def _mangled(name: str) -> str:
    return name.replace("/", "%")
