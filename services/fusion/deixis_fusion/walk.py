"""Where the parts of a walk begin, in each of which the person hardly moved: kept as frames come, not looked for in each."""

from __future__ import annotations

# So far a POI that is 2 m off moves by 7 degrees, about what a pointing arm tells.
APART_M = 0.25
FARTHER = 1.5
MOST_VIEWS = 8


class Walk:
    """Consecutive places of a person, seen from above: x + yj, metres. A part ends where the person is too far from its first.

    With more parts than there may be views, parts are longer. `starts` are the places that parts begin with.
    """

    def __init__(self) -> None:
        self._spots: list[complex] = []
        self._apart_m = APART_M
        self.starts: list[int] = []

    def add(self, spot: complex) -> None:
        """The next place."""
        self._spots.append(spot)
        if not self.starts or abs(spot - self._spots[self.starts[-1]]) > self._apart_m:
            self.starts.append(len(self._spots) - 1)
        while len(self.starts) > MOST_VIEWS:
            self._apart_m *= FARTHER
            self.starts = _starts(self._spots, self._apart_m)

    def __len__(self) -> int:
        return len(self._spots)


def _starts(spots: list[complex], apart_m: float) -> list[int]:
    starts, first = [0], spots[0]
    for i, spot in enumerate(spots):
        if abs(spot - first) > apart_m:
            starts.append(i)
            first = spot
    return starts
