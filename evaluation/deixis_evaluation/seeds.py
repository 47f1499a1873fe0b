"""Which seeds of the simulator are for what: what was fitted or chosen on a set says nothing when scored on it."""

from __future__ import annotations

import re
from dataclasses import dataclass

MAX_SEEDS = 1000
LAST_SEED = 10**9
SETS: tuple[tuple[str, int, int], ...] = (
    ("fitting", 0, 1000),
    ("choosing", 1000, 2000),
    ("reporting", 2000, LAST_SEED),
)
"""Name of a set, its first seed, and the first one beyond it."""


class SeedsError(ValueError):
    """Seeds that cannot be used; the text says why."""


@dataclass(frozen=True)
class Seeds:
    """Seeds `first` to `beyond` - 1, all of one set."""

    first: int
    beyond: int
    purpose: str

    @property
    def numbers(self) -> range:
        """Each of them."""
        return range(self.first, self.beyond)

    def __str__(self) -> str:
        return f"{self.first}:{self.beyond}"


def parse_seeds(text: str) -> Seeds:
    """Read `A:B`, the seeds A to B - 1. Raises SeedsError for anything else, and where they belong to more than one set."""
    found = re.fullmatch(r"(\d{1,10}):(\d{1,10})", text)
    if not found:
        raise SeedsError(f"--seeds {text}: not of the form A:B, e.g. 1000:1060 for the seeds 1000 to 1059")
    first, beyond = int(found[1]), int(found[2])
    if not first < beyond <= LAST_SEED:
        raise SeedsError(f"--seeds {text}: no seeds lie between them")
    if beyond - first > MAX_SEEDS:
        raise SeedsError(f"--seeds {text}: {beyond - first} seeds, more than {MAX_SEEDS}")
    purpose, limit = next((name, limit) for name, start, limit in SETS if start <= first < limit)
    if beyond > limit:
        raise SeedsError(f"--seeds {text}: reaches from the set '{purpose}' ({_said(purpose)}) into the next; score sets apart")
    return Seeds(first, beyond, purpose)


def say_set(seeds: Seeds) -> str:
    """What the seeds are for, in a sentence."""
    return f"seeds {seeds} belong to the set '{seeds.purpose}' ({_said(seeds.purpose)})"


def _said(purpose: str) -> str:
    name, start, limit = next(row for row in SETS if row[0] == purpose)
    span = f"{start} and above" if limit == LAST_SEED else f"{start} to {limit - 1}"
    return f"seeds {span} are for {name}"
