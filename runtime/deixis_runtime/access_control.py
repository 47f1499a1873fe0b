"""What a site's list of access means to Zenoh: roles become the `access_control` of a router, deny by default.

Each router judges its own links: what a peer sends (`ingress`) and what it is given (`egress`), by the common name of its
certificate. The roles, with `{robot}` their own robot and `*` any:

    robot   sends its camera's topics, `robot/pose`, health and liveliness of `{robot}`; is given all of `{robot}` but frames.
            Where frames stay with it, it sends the topics of the other stages in their place.
    edge    sends the topics of all stages but the camera; is given all, frames too unless they stay with the robots
    viewer  sends nothing; is given all but frames. Gets on `fusion/poi` may be edits, so `fusion/state` tells viewers of POIs
    editor  as a viewer; and puts, deletes and gets on `fusion/poi`

Who is heard for a stage is a matter of its own host, and of the edge: a get on `{stage}/voice/...` may be a swap.

Who links through a Unix socket, or by TCP from this host itself, is not of another host, and may do all. Rules of all subjects
that match a link add up, and what one of them allows no other can deny: so none may match a link of another role.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from deixis_schemas import topics
from deixis_schemas.topics import Topic

from .access import AccessList, Member, Role

ANY = "*"
CAMERA = topics.FRAME.stage
# `**` does not match chunks that begin with `@`.
EVERYTHING = ("**", "**/@alive/**", "**/@standby/**", "**/@adv/**", "@/**")
DATA = ("put", "delete")
DECLARATIONS = ("declare_subscriber", "declare_queryable")
LIVELINESS_INTEREST = ("liveliness_query", "declare_liveliness_subscriber")
ALL_MESSAGES = (*DATA, *DECLARATIONS, "query", "reply", "liveliness_token", *LIVELINESS_INTEREST)
LOOPBACK_INTERFACES = ("lo", "lo0")
# All protocols of a Zenoh link but that of a Unix socket, by which only programs of this host come.
NETWORK_PROTOCOLS = ("tcp", "udp", "tls", "quic", "ws", "serial", "unixpipe", "vsock")


@dataclass(frozen=True)
class Grant:
    """What one kind of messages is allowed on, in one direction: `ingress` is from the peer, `egress` to it."""

    flow: str
    messages: tuple[str, ...]
    keys: tuple[str, ...]


def access_control(listed: AccessList) -> dict[str, Any]:
    """The value of `access_control` in the settings of a router of the site, for Zenoh 1.10."""
    subjects: list[dict[str, Any]] = [
        {"id": "local socket", "link_protocols": ["unixsock-stream"]},
        {"id": "local tcp", "link_protocols": ["tcp"], "interfaces": list(LOOPBACK_INTERFACES)},
    ]
    grants = {"local": [Grant(flow, ALL_MESSAGES, EVERYTHING) for flow in ("ingress", "egress")]}
    holders = {"local": ["local socket", "local tcp"]}
    for who, members, granted in _groups(listed):
        subjects.append({"id": who, "cert_common_names": [str(member) for member in members]})
        grants[who], holders[who] = granted, [who]
    rules = {
        who: [
            {
                "id": f"{who} {number}",
                "permission": "allow",
                "flows": [grant.flow],
                "messages": list(grant.messages),
                "key_exprs": list(grant.keys),
            }
            for number, grant in enumerate(granted)
        ]
        for who, granted in grants.items()
    }
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [rule for made in rules.values() for rule in made],
        "subjects": subjects,
        "policies": [
            {"id": who, "rules": [rule["id"] for rule in made], "subjects": holders[who]} for who, made in rules.items()
        ],
    }


def frames_stay_here() -> dict[str, Any]:
    """The value of `access_control` where all is allowed but that frames leave this host by any network."""
    return {
        "enabled": True,
        "default_permission": "allow",
        "rules": [
            {
                "id": "frames",
                "permission": "deny",
                "flows": ["egress"],
                "messages": ["put", "reply"],
                "key_exprs": [topics.FRAME.key(ANY)],
            }
        ],
        "subjects": [{"id": "network", "link_protocols": list(NETWORK_PROTOCOLS)}],
        "policies": [{"id": "frames", "rules": ["frames"], "subjects": ["network"]}],
    }


def _groups(listed: AccessList) -> Iterator[tuple[str, list[Member], list[Grant]]]:
    """Those who have the same rights, by a name of theirs: each robot has its own."""
    for member in listed.of_role("robot"):
        yield str(member), [member], _robot(member.name, stay=listed.frames_stay)
    others: dict[Role, list[Grant]] = {
        "edge": _edge(stay=listed.frames_stay),
        "viewer": _viewer(),
        "editor": [*_viewer(), *_edits()],
    }
    for role, granted in others.items():
        members = listed.of_role(role)
        if members:
            yield role, members, granted


def _robot(robot: str, *, stay: bool) -> list[Grant]:
    stages = topics.STAGES if stay else (CAMERA,)
    published = [topic for topic in _published_by(stages) if not (stay and topic is topics.FRAME)]
    published.append(topics.ROBOT_POSE)
    return [*_sends(robot, stages, published), *_asks(robot, _readable()), *_is_given(robot, _readable())]


def _edge(*, stay: bool) -> list[Grant]:
    stages = tuple(stage for stage in topics.STAGES if stage != CAMERA)
    readable = _readable() if stay else [*_readable(), topics.FRAME]
    return [
        *_sends(ANY, stages, _published_by(stages)),
        # It passes on what others ask of it, each of whom its own router has judged: wildcards and edits of POIs among it.
        Grant("ingress", (*DECLARATIONS, "query"), ("**",)),
        *_edits(),
        Grant("ingress", LIVELINESS_INTEREST, _alive(ANY)),
        *_is_given(ANY, readable),
    ]


def _viewer() -> list[Grant]:
    return [*_asks(ANY, _readable()), *_is_given(ANY, _readable())]


def _edits() -> list[Grant]:
    return [Grant("ingress", (*DATA, "query"), _keys(ANY, [topics.POI]))]


def _sends(robot: str, stages: Iterable[str], published: list[Topic]) -> list[Grant]:
    """What is allowed to a host that these stages of the robot run on, under a supervisor."""
    processes = (*stages, topics.SUPERVISOR)
    answered = [topic for topic in published if topic.queryable]
    health = tuple(topics.HEALTH.key(robot, stage=name) for name in processes)
    keys = (topics.alive_key, topics.standby_alive_key)
    alive = tuple(key(robot, name, ANY) for key in keys for name in processes)
    return [
        Grant("ingress", DATA, (*_keys(robot, published), *health)),
        Grant("ingress", ("declare_queryable", "reply"), (*_keys(robot, answered), *health)),
        Grant("ingress", ("liveliness_token",), alive),
        Grant("egress", ("query", *LIVELINESS_INTEREST), (_all_of(robot), *_alive(robot))),
    ]


def _asks(robot: str, readable: list[Topic]) -> list[Grant]:
    """What is allowed to one who subscribes and asks. A get on a POI may be an edit, one on a voice a swap."""
    # A wildcard that takes frames in would draw them over the link for nothing.
    wildcards = (f"deixis/{robot}/{stage}/**" for stage in topics.STAGES if stage != CAMERA)
    answered = [topic for topic in readable if topic.queryable and topic not in (topics.POI, topics.VOICE)]
    return [
        Grant("ingress", ("declare_subscriber",), (*_keys(robot, readable), *wildcards)),
        Grant("ingress", ("query",), _keys(robot, answered)),
        Grant("ingress", LIVELINESS_INTEREST, _alive(robot)),
    ]


def _is_given(robot: str, readable: list[Topic]) -> list[Grant]:
    """What is let through to one who reads these topics. Declarations only name keys; what comes on these is judged, too."""
    return [
        Grant("egress", (*DATA, "reply"), _keys(robot, readable)),
        Grant("egress", DECLARATIONS, ("**",)),
        Grant("egress", ("liveliness_token",), _alive(robot)),
    ]


def _published_by(stages: Iterable[str]) -> list[Topic]:
    return [topic for stage in stages for topic in topics.TOPICS if topic.stage == stage]


def _readable() -> list[Topic]:
    return [topic for topic in topics.TOPICS if topic is not topics.FRAME]


def _keys(robot: str, of: Iterable[Topic]) -> tuple[str, ...]:
    """Key expressions of topics: of all POIs, of the health of all stages."""
    return tuple(topic.key(robot, stage=ANY, id="**") for topic in of)


def _all_of(robot: str) -> str:
    return f"deixis/{robot}/**"


def _alive(robot: str) -> tuple[str, ...]:
    return (topics.alive_key(robot, "**", ANY).removesuffix("/*"),)
