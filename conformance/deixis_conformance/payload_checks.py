"""Keys, labels, schemas and producers of all that a stage publishes. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from deixis_schemas.messages import Produced

from .observation import Phase, decoded
from .results import Result, judged

OWN_KEYS = "publish on deixis/{{robot}}/{stage}/... alone: two voices on one key are two stages to those who listen"
LABELS = "set the encoding of each put: application/msgpack;Type/version (schemas/contract/topics.md)"
SCHEMA = "compare with schemas/contract/*.schema.json, and with the golden bytes beside them"
PRODUCER = "name the stage and the instance of the liveliness token in every message"
FLOOD = "publish once a frame, and once a second for health; a check keeps 20000 messages or 512 MiB of a phase"
SHOWN = 3


def check_payloads(stage: str, phases: Sequence[Phase]) -> list[Result]:
    """Whether all that the stage published is on its keys, labelled, and valid."""
    heard = [item for phase in phases for item in phase.heard]
    foreign = sorted({item.key for item in heard if _is_foreign(item.key, stage)})
    good, bad = decoded([item for item in heard if not _is_foreign(item.key, stage)])
    labels = sorted({f"{refused.key}: {refused.why}" for refused in bad if refused.mislabelled})
    broken = sorted({f"{refused.key}: {refused.why}" for refused in bad if not refused.mislabelled})
    return [
        judged(
            "keys",
            "publishes on its own keys alone",
            f"publishes on {', '.join(foreign[:SHOWN])}" if foreign else None,
            OWN_KEYS.format(stage=stage),
        ),
        judged("labels", f"{len(good)} messages carry the label of their type", _some(labels), LABELS),
        judged("schema", f"{len(good)} messages keep their schema", _some(broken), SCHEMA),
        *_flood(phases),
    ]


def _flood(phases: Sequence[Phase]) -> list[Result]:
    """A failure where more came than is kept: what was not heard was not judged."""
    unheard = sum(phase.unheard for phase in phases)
    return [Result("flood", "failed", f"{unheard} messages came beyond those that were judged", FLOOD)] if unheard else []


def check_producer(stage: str, phases: Sequence[Phase], instance: str | None) -> list[Result]:
    """Whether the stage names itself, always by the same name: that of its liveliness token, where one stands."""
    good, _ = decoded([item for phase in phases for item in phase.heard])
    named = {f"{message.stage}/{message.instance}" for _, message in good if isinstance(message, Produced)}
    if not named:
        return []
    said = ", ".join(sorted(named))
    expected = f"{stage}/{instance}" if instance else f"one name that begins with {stage}/"
    right = named == {expected} if instance else len(named) == 1 and said.startswith(f"{stage}/")
    wrong = None if right else f"messages name {said}, where {expected} was expected"
    return [judged("producer", f"all messages name {said}", wrong, PRODUCER)]


def _is_foreign(key: str, stage: str) -> bool:
    parts = key.split("/")
    return len(parts) < 3 or parts[2] != stage


def _some(texts: Sequence[str]) -> str | None:
    return "; ".join(texts[:SHOWN]) if texts else None
