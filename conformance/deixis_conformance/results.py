"""What a check found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Outcome = Literal["passed", "failed", "noted", "skipped"]


@dataclass(frozen=True)
class Result:
    """One check. noted: not what the best stages do, and no breach. skipped: it could not be made. advice: what to do."""

    name: str
    outcome: Outcome
    found: str
    advice: str = ""


def judged(name: str, right: str, wrong: str | None, advice: str) -> Result:
    """Failed, with what is wrong and advice; or passed, with what is right, where nothing is wrong."""
    return Result(name, "failed", wrong, advice) if wrong is not None else Result(name, "passed", right)
