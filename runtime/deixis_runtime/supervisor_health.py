"""What the supervisor's health says of its children: how often each was started again, why, and who is given up."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from deixis_schemas.messages import HealthState

from .supervisor import Process


@dataclass(frozen=True)
class Account:
    """State and reason of the health record, its notes by child, and the restarts of each."""

    state: HealthState
    reason: str
    notes: dict[str, str]
    restarts: dict[str, int]


def account_of(processes: Collection[Process], now_s: float) -> Account:
    """What is to be said at this monotonic time."""
    lost = [f"{process.name} is given up: {process.given_up}" for process in processes if process.given_up]
    notes = {process.name: _note(process, now_s) for process in processes if process.last_end and not process.given_up}
    restarts = {process.name: process.started - 1 for process in processes if process.started > 1}
    return Account("degraded" if lost else "ok", "; ".join(lost), notes, restarts)


def _note(process: Process, now_s: float) -> str:
    restarts = process.started - 1
    if process.replaced:
        since_s = now_s - process.ended_s
        return f"{process.name}: another process has its place since {since_s:.0f} s; it is started again when that is gone"
    if process.once:
        return f"{process.name}: ended {now_s - process.ended_s:.0f} s ago ({process.last_end}); it is not started again"
    often = f"started again {restarts} time{'s' if restarts > 1 else ''}" if restarts else "waits to be started again"
    return f"{process.name}: {often}; the last end, {now_s - process.ended_s:.0f} s ago: {process.last_end}"
