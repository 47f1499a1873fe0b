"""The contract as one page for people: from the topic table and the types, so that it says what the code does."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .messages import TYPES, Message
from .schema_words import default_of, link, what
from .topics import INPUTS, SENT, STAGES, SWAPPABLE, TOPICS, Topic, alive_key, standby_alive_key, standby_key

INTRODUCTION = """# The contract

Written by `make contract` from `schemas/deixis_schemas`; edit that. What a stage in any language has to know: keys,
types, rates, ages, and what silence means. Whether it keeps to it says `deixis check-stage` ([write your own
stage](write-your-own-stage.md)).

## On the wire

* Keys are `deixis/{robot}/{stage}/{topic}`. A robot's name, an instance, a POI's id are each one part of a key: 1 to 64
  letters, digits, `_`, `.` and `-`, not beginning with `.` or `-`.
* A payload is a msgpack map with string keys; binary fields are msgpack `bin`, numbers are what they are (no strings).
  Its Zenoh encoding is `application/msgpack;Type/version`. Without that label, or with another version, a message is
  counted, reported and used by nobody.
* Fields that a reader does not know are ignored, so fields may be added. A field that changes its meaning raises the
  version, and then both sides are changed together. Optional fields have a default here; a writer may leave them out.
* A get with `?format=json` is answered in JSON (`application/json`), binary fields in URL-safe base64 (RFC 4648, section
  5).
* For each type there are a JSON Schema, golden bytes and the same as JSON in [schemas/contract](../schemas/contract). A
  schema cannot say all: rules between fields stand in the description of the type below, and the golden bytes are what a
  codec is to be tried on.
* Lengths are metres, angles degrees where a field ends in `_deg` (px, Hz, ns alike). Bearings and yaw are measured at the
  person, from the direction person -> camera, positive toward the image's right: the person's own left (REP-103). Maps
  follow REP-103, cameras REP-105.
* `run` and `seq` name a frame. Who derives something from a frame repeats `run`, `seq` and `stamp_ns`, and names itself
  in `stage` and `instance`. Another `run` is the only sign that a camera begins anew.
* A stage holds the liveliness token `{alive}` while it works.
* It works on the newest input that it has and never on a backlog, answers each frame that it works on once, also with an
  empty list, and drops what is older than the table allows (not where `camera/info` says `lockstep`).

## Changing places

Two processes of one stage (of {swappable}) can change places between two frames, ordered by `deixis swap`.
No stage need take part; one that does owes this ([swap.md](swap.md#replace-a-stage-while-it-runs) names an example):

* Started with `DEIXIS_STAND_BY=1` in its environment it stands by: it works on all that comes, holds the token
  `{standby_alive}` in place of the other, and puts its answers on
  `{standby}`, with the label and fields they would have. Its health, if it gives one, says
  `standing_by`.
* It answers gets on `deixis/{robot}/{stage}/voice/{instance}` with a `Voice`, or with an error that says why not:
  without a parameter, how it stands; and `?op=` one of these:
* `take;from=OLD`, to one that stands by: it gets `?op=yield;to=ITSELF` from OLD. Where the answer comes within 1.5 s, the
  frame that it names and all behind it are the newcomer's (all frames, where it names none); it exchanges its token at
  once, and puts answers to those frames on the topic. Where none comes in time it stands by as before.
* `yield;to=NEW`, to the one that is heard: it names a frame some 15 ahead of the last that it has answered (the next one,
  where none come), once; asked again by NEW it names the same, and another than NEW is refused. It exchanges its token at
  once, answers the frames before that one on the topic, and those behind it aside. Frames of the runs that begin later
  are behind it.
* `leave`, to one that has yielded: it ends, with status 0.
* One that has yielded should watch the token of NEW: where it does not come within 2.5 s, or goes while the link to the
  router stands, it is heard again, from the first frame on that neither has answered.
"""


def contract_page() -> str:
    """The page in Markdown."""
    filled = {
        "{alive}": alive_key("{robot}", "{stage}", "{instance}"),
        "{standby_alive}": standby_alive_key("{robot}", "{stage}", "{instance}"),
        "{standby}": standby_key(TOPICS[0], "{robot}").replace(TOPICS[0].path, "{stage}/{topic}"),
        "{swappable}": ", ".join(SWAPPABLE),
    }
    text = INTRODUCTION
    for name, value in filled.items():
        text = text.replace(name, value)
    return "\n".join([text, *_topics(), *_stages(), *_types()]).rstrip() + "\n"


def _topics() -> Iterator[str]:
    yield "## Topics\n"
    yield "| key under `deixis/{robot}/` | type | when | by get | most bytes | oldest | delivery |"
    yield "|---|---|---|---|---|---|---|"
    for topic in TOPICS:
        by_get = "yes" if topic.queryable else "no"
        oldest = f"{topic.max_age_s:g} s" if topic.max_age_s else "-"
        yield (
            f"| `{topic.path}` | {link(_name(topic))} | {_when(topic)} | {by_get} | {_size(topic.max_bytes)} | {oldest} "
            f"| {topic.delivery.value} |"
        )
    yield from _deliveries()
    yield "\nWhat it means when nothing comes:\n"
    for topic in TOPICS:
        yield f"* `{topic.path}`: {topic.silence}"
    yield ""


def _deliveries() -> Iterator[str]:
    yield "\nWhat a delivery is in Zenoh (of `reply`: what gets ask with). Congestion control is `DROP` (`BLOCK` where"
    yield "`camera/info` says `lockstep`), reliability is left as it is; who keeps something answers a get with the last one:\n"
    yield "| delivery | priority | express |"
    yield "|---|---|---|"
    for stance, sent in SENT.items():
        yield f"| {stance.value.partition(':')[0]} | `{sent.priority}` | {'yes' if sent.express else 'no'} |"


def _stages() -> Iterator[str]:
    yield "## Stages\n"
    yield "| stage | works on | answers each frame on | also |"
    yield "|---|---|---|---|"
    for stage in STAGES:
        own = [topic for topic in TOPICS if topic.stage == stage]
        by_frame = [topic for topic in own if topic.rate_hz and topic.max_age_s]
        others = [topic for topic in own if topic not in by_frame]
        inputs = ", ".join(f"`{topic.path}`" for topic in INPUTS[stage]) or "its source"
        yield f"| {stage} | {inputs} | {_paths(by_frame)} | {_paths(others)} |"
    yield ""


def _types() -> Iterator[str]:
    yield "## Types\n"
    parts: dict[str, dict[str, Any]] = {}
    for type_ in TYPES.values():
        schema = type_.model_json_schema()
        parts |= schema.get("$defs", {})
        yield from _type(f"{type_.__name__}/{type_.VERSION}", schema, _description(type_))
    yield "## Parts of messages\n"
    for name, schema in sorted(parts.items()):
        yield from _type(name, schema, schema.get("description", ""))


def _type(name: str, schema: dict[str, Any], description: str) -> Iterator[str]:
    yield f"### {name}\n"
    yield f"{' '.join(description.split())}\n"
    yield "| field | what | default | |"
    yield "|---|---|---|---|"
    required = schema.get("required", [])
    for field, content in schema.get("properties", {}).items():
        default = "" if field in required else default_of(content)
        yield f"| `{field}` | {what(content)} | {default} | {' '.join(content.get('description', '').split())} |"
    yield ""


def _description(type_: type[Message]) -> str:
    return type_.__doc__ or ""


def _name(topic: Topic) -> str:
    return f"{topic.type.__name__}/{topic.version}"


def _when(topic: Topic) -> str:
    return topic.by.value + (f", {topic.rate_hz:g} Hz" if topic.rate_hz else "")


def _size(count: int) -> str:
    return f"{count >> 20} MiB" if count >= 1 << 20 else f"{count >> 10} KiB"


def _paths(found: list[Topic]) -> str:
    return ", ".join(f"`{topic.path}`" for topic in found) or "-"
