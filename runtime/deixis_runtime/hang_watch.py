"""Who of the children hangs: the watchdog with its ears (notifications) and eyes (/proc)."""

from __future__ import annotations

from collections.abc import Mapping

from .notifications import Notifications
from .procfs import Look, look_at, unable_s
from .watchdog import Patience, Watchdog


class HangWatch:
    """Hears the children and looks at those who are silent."""

    def __init__(self, notifications: Notifications, patience: Patience) -> None:
        self._notifications = notifications
        self._watchdog = Watchdog(patience)
        self._looks: dict[int, Look] = {}
        self._looked_s = 0.0

    def hear(self) -> set[int]:
        """Take note of the signs that came; process numbers of those who gave them."""
        senders = self._notifications.senders()
        for pid in senders:
            self._watchdog.beat(pid)
        return senders

    def take_leaving(self) -> set[int]:
        """Those who have said since the last call that they end."""
        return self._notifications.take_leaving()

    def hanging(self, running: Mapping[str, int], now_s: float) -> dict[str, str]:
        """Those of the `running` processes (pid by name) that hang, with the reason; now_s: monotonic. Hear them before."""
        looks = {pid: look for pid in self._watchdog.suspects() if (look := look_at(pid)) is not None}
        between_s = now_s - self._looked_s
        unable = {pid: unable_s(self._looks[pid], look, between_s) for pid, look in looks.items() if pid in self._looks}
        self._looks, self._looked_s = looks, now_s
        return self._watchdog.hanging(running, now_s, unable)
