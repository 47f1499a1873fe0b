"""Waits for the first final answer of a robot: heard, or remembered by fusion where it came before us."""

from __future__ import annotations

from deixis_schemas.messages import Message, State, Target

ASK_EVERY_S = 2.0


class FirstAnswer:
    """Hears what is published, and the state where it is asked for; times are monotonic seconds."""

    def __init__(self) -> None:
        self.target: Target | None = None
        self._asked_s: float | None = None

    def hear(self, message: Message | None) -> None:
        """A message was published, or fusion's state came."""
        if self.target is not None:
            return
        if isinstance(message, Target) and message.final:
            self.target = message
        elif isinstance(message, State) and message.recent_targets:
            self.target = message.recent_targets[0]

    def should_ask(self, now_s: float) -> bool:
        """Whether to ask for fusion's state now: at first, and again and again, for a target may be lost on the way."""
        due = self.target is None and (self._asked_s is None or now_s - self._asked_s >= ASK_EVERY_S)
        if due:
            self._asked_s = now_s
        return due

    def problem(self, expected: str | None) -> str:
        """What is wrong with the answer; empty if nothing."""
        if self.target is None:
            return "no final answer came"
        if expected is not None and self.target.poi_ids != [expected]:
            return f"expected the one answer '{expected}', but got: {' or '.join(self.target.poi_ids) or 'no answer'}"
        return ""
