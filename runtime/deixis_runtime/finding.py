"""One thing that `deixis doctor` finds. Distributions add what only they can examine: see `LOCAL_CHECKS`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Level = Literal["ok", "note", "wrong"]

LOCAL_CHECKS = "deixis.checks"
"""Entry points of this group are functions `(source: str | None) -> Iterable[Finding]` about this machine."""


@dataclass(frozen=True)
class Finding:
    """Whether it is wrong, what it is, and what to do."""

    level: Level
    what: str
    advice: str = ""
