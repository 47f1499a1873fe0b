"""A share of counted frames, with its interval."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from .wilson import wilson


@dataclass(frozen=True)
class Proportion:
    """`hits` of `total`."""

    hits: int
    total: int

    @classmethod
    def of(cls, outcomes: Iterable[bool]) -> Proportion:
        """How many of the outcomes are true."""
        counted = list(outcomes)
        return cls(sum(counted), len(counted))

    @property
    def share(self) -> float | None:
        """0 to 1; none where there was nothing."""
        return self.hits / self.total if self.total else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of the share (Wilson), as if the frames were independent."""
        return wilson(self.hits, self.total)
