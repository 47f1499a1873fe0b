"""`deixis compare`: where two recorded runs of one source differ."""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

from deixis_cli.inbox import read_message
from deixis_cli.mcap_file import McapFileError, McapReader
from deixis_cli.options import CommandError, add_json
from deixis_schemas import codec, topics
from deixis_schemas.messages import Belief, FrameId, Message, OfFrame, Produced
from deixis_schemas.topics import By, Delivery

from .differences import Difference, differences

# The frames themselves are compared by what the stages see in them.
COMPARED = tuple(dict.fromkeys(t.stage for t in topics.TOPICS if t.by is By.FRAME and t.delivery is not Delivery.BULK_NEWEST))


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("compare", help="where two recorded runs differ", description=__doc__)
    parser.add_argument("first", type=Path, metavar="RUN1.mcap")
    parser.add_argument("second", type=Path, metavar="RUN2.mcap")
    parser.add_argument("--exact", action="store_true", help="allow no difference in what is said, however small")
    add_json(parser, "print one JSON document")
    parser.set_defaults(run=run)


@dataclass
class Run:
    """What a recording holds of each stage, in the order heard; of the camera's first run alone, which is one pass of a source.

    heard_ns, answered_ns: by frame, when its first message and its belief were heard. unreadable: messages that break the
    contract. later: messages of later runs. cut_off: one line for people where the recording was cut off, or empty.
    """

    by_stage: dict[str, list[Message]] = field(default_factory=dict)
    heard_ns: dict[FrameId, int] = field(default_factory=dict)
    answered_ns: dict[FrameId, int] = field(default_factory=dict)
    unreadable: int = 0
    later: int = 0
    cut_off: str = ""

    def took_ms(self) -> list[float]:
        """Of each answered frame, from the first that was heard of it to its belief, ms."""
        return [(at - self.heard_ns[frame]) / 1e6 for frame, at in self.answered_ns.items()]


@dataclass(frozen=True)
class StageComparison:
    """One stage in two runs. messages: how many in each; unequal: how many differ at all; beyond: those past the tolerances."""

    stage: str
    messages: tuple[int, int]
    unequal: int
    beyond: list[Difference]

    def differs(self, *, exact: bool) -> bool:
        """Whether there is a difference that counts."""
        return bool(self.beyond) or (exact and self.unequal > 0)


def run(given: argparse.Namespace) -> int:
    """Print the comparison. 1 where the runs differ. Raises CommandError for a recording that cannot be read."""
    try:
        first, second = read_run(given.first), read_run(given.second)
    except McapFileError as error:
        raise CommandError(str(error)) from None
    for path, found in ((given.first, first), (given.second, second)):
        if found.cut_off:
            print(f"deixis compare: {found.cut_off}", file=sys.stderr)
        if not found.by_stage:
            raise CommandError(f"'{path}' holds no answers of any stage to a frame")
    compared = compare(first, second)
    differs = any(stage.differs(exact=given.exact) for stage in compared)
    if given.json:
        print(json.dumps(document(first, second, compared, differs=differs)))
    else:
        print("\n".join(lines(first, second, compared)))
    return 1 if differs else 0


def compare(first: Run, second: Run) -> list[StageComparison]:
    """Each stage that both or one of them holds, in the order of the chain."""
    found = []
    for stage in COMPARED:
        old, new = first.by_stage.get(stage, []), second.by_stage.get(stage, [])
        if old or new:
            found.append(StageComparison(stage, (len(old), len(new)), _unequal(old, new), differences(stage, old, new)))
    return found


def read_run(path: Path) -> Run:
    """The run in a recording. Raises McapFileError."""
    found, first_run = Run(), None
    reader = McapReader(path)
    for raw in reader:
        topic = topics.topic_of(raw.key)
        if topic is None or raw.deleted or topic.stage not in topics.STAGES or topic is topics.POI:
            continue
        try:
            message = read_message(topic, raw.key, raw.payload, raw.encoding)
        except codec.CodecError:
            found.unreadable += 1
            continue
        if not isinstance(message, OfFrame):
            continue
        first_run = message.run if first_run is None else first_run
        if message.run != first_run:
            found.later += 1
            continue
        _add(found, topic.stage, message, raw.received_ns)
    found.cut_off = reader.cut_off
    return found


def lines(first: Run, second: Run, compared: Iterable[StageComparison]) -> list[str]:
    """The comparison for people."""
    text = []
    for stage in compared:
        old, new = stage.messages
        count = f"{old} messages" if old == new else f"{old} messages, then {new}"
        equal = "all equal" if not stage.unequal else f"{stage.unequal} not equal"
        text.append(
            f"{stage.stage}: {count}, {equal}" + ("" if stage.beyond or not stage.unequal else ", within the tolerances")
        )
        text += [f"  {difference}" for difference in stage.beyond]
    for run_, which in ((first, "first"), (second, "second")):
        took_ms = run_.took_ms()
        if took_ms:
            text.append(
                f"time to the belief of a frame, {which} run: median {median(took_ms):.1f} ms, most {max(took_ms):.1f} ms"
            )
        if run_.later:
            text.append(f"{which} run: {run_.later} messages left out: they are of later runs of the camera")
        if run_.unreadable:
            text.append(f"{which} run: {run_.unreadable} messages left out: they break the contract")
    return text


def document(first: Run, second: Run, compared: Iterable[StageComparison], *, differs: bool) -> dict[str, Any]:
    """The comparison for programs."""
    return {
        "differs": differs,
        "stages": {
            stage.stage: {
                "messages": list(stage.messages),
                "unequal": stage.unequal,
                "beyond": [str(difference) for difference in stage.beyond],
            }
            for stage in compared
        },
        "took_ms_p50": [round(median(took), 3) if (took := run_.took_ms()) else None for run_ in (first, second)],
        "later": [first.later, second.later],
        "unreadable": [first.unreadable, second.unreadable],
    }


def _add(found: Run, stage: str, message: OfFrame, received_ns: int) -> None:
    found.heard_ns.setdefault(message.frame_id, received_ns)
    if stage in COMPARED:
        found.by_stage.setdefault(stage, []).append(message)
    if isinstance(message, Belief):
        found.answered_ns.setdefault(message.frame_id, received_ns)


def _unequal(old: list[Message], new: list[Message]) -> int:
    """Messages that are not the same in both, or that only one has; those about one frame stand against each other."""
    before, after = _by_place(old), _by_place(new)
    return sum(before.get(place) != after.get(place) for place in before.keys() | after.keys())


def _by_place(messages: list[Message]) -> dict[tuple[int, str, int], Message]:
    """Messages by the frame's number, the type, and which of them it is."""
    counts: Counter[tuple[int, str]] = Counter()
    placed = {}
    for message in messages:
        name = (message.seq if isinstance(message, OfFrame) else -1, type(message).__name__)
        placed[*name, counts[name]] = _content(message)
        counts[name] += 1
    return placed


def _content(message: Message) -> Message:
    """The message without its producer's process, run and times, which differ between any two runs that are not in lockstep."""
    if not isinstance(message, Produced):
        return message
    return message.model_copy(update={"stamp_ns": 0, "instance": "", "run": 0})
