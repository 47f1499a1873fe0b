"""What other programs show of a recording by themselves, made by whoever is installed for it: entry points `deixis.shown`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.metadata import entry_points
from pathlib import Path
from typing import NamedTuple

from .raw_message import RawMessage

GROUP = "deixis.shown"


class Shown(NamedTuple):
    """A message for viewers of MCAP files, beside what was sent; nobody replays it.

    schema, schema_encoding and schema_data: as MCAP has them. encoding: of the payload, by MCAP's words.
    """

    topic: str
    schema: str
    schema_encoding: str
    schema_data: bytes
    encoding: str
    payload: bytes


Show = Callable[[RawMessage], list[Shown]]


def show_by_all(site: Path | None) -> Show | None:
    """What is to be shown of each message in turn; none where nobody here can. Raises CommandError for a bad site file."""
    makers: list[Show] = [entry.load()(site) for entry in entry_points(group=GROUP)]
    if not makers:
        return None

    def of_all(message: RawMessage) -> list[Shown]:
        def each() -> Iterator[Shown]:
            for maker in makers:
                yield from maker(message)

        return list(each())

    return of_all
