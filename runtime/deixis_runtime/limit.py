"""Rate limit of messages: one line per cause and period, with the number left out since."""

from __future__ import annotations


class RateLimit:
    """Tells whether a message of a kind may be said now. Holds at most `max_kinds` kinds."""

    def __init__(self, period_s: float = 10.0, max_kinds: int = 256) -> None:
        self._period_s = period_s
        self._max_kinds = max_kinds
        self._said: dict[str, tuple[float, int]] = {}

    def allow(self, kind: str, now_s: float) -> int | None:
        """None while the kind is silenced; otherwise how many messages of it were left out since the last one said."""
        last = self._said.get(kind)
        if last is not None and now_s - last[0] < self._period_s:
            self._said[kind] = (last[0], last[1] + 1)
            return None
        if last is None and len(self._said) >= self._max_kinds:
            self._said.pop(next(iter(self._said)))
        self._said[kind] = (now_s, 0)
        return last[1] if last else 0
