"""What a router has to say of its links while it runs: whether they stand, why not, and how its certificate stands."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from .certificates import Certificates
from .endpoint import is_guarded
from .finding import Finding

EXPLAIN_AFTER_S = 3.0
EXPLAIN_EVERY_S = 60.0
DATES_EVERY_S = 600.0
NOTE_EVERY_S = 86_400.0
WRONG_EVERY_S = 3_600.0

Line = tuple[int, str]
"""A level of the log, and what is to be said."""


class CertificateWatch:
    """Looks at a certificate now and then, and says how it stands: a note once a day, what is wrong once an hour.

    complaint: what there is to be said of it as of the last look; None where nothing is.
    """

    def __init__(self, certificates: Certificates) -> None:
        self._certificates = certificates
        self._look_s = -float("inf")
        self._said_s = -float("inf")
        self._level = "ok"
        self.complaint: str | None = None
        self._begun = self._versions()

    def turn(self, monotonic_s: float, now_s: float) -> Finding | None:
        """What is to be said now, if anything. `now_s` is Unix seconds, by which certificates are judged."""
        if monotonic_s - self._look_s < DATES_EVERY_S:
            return None
        self._look_s = monotonic_s
        found = self.examine(now_s)
        pause_s = WRONG_EVERY_S if found.level == "wrong" else NOTE_EVERY_S
        due = found.level != self._level or monotonic_s - self._said_s >= pause_s
        self._level = found.level
        self.complaint = None if found.level == "ok" else say(found)
        if found.level == "ok" or not due:
            return None
        self._said_s = monotonic_s
        return found

    def examine(self, now_s: float) -> Finding:
        """How the certificate stands; a changed file is worth a note, for Zenoh has read the old one."""
        # Here, for a process without certificates needs no `ssl`.
        from .certificate_check import examine  # noqa: PLC0415

        found = examine(self._certificates, now_s)
        if found.level == "ok" and self._versions() != self._begun:
            changed = f"the files in {self._certificates.folder} have changed since this process began"
            return Finding("note", changed, "restart it to use them")
        return found

    def _versions(self) -> tuple[int, ...]:
        return tuple(_version(file) for file in (self._certificates.certificate, self._certificates.access))


class LinkWatch:
    """Follows a router's links to others, and says in the log what changes; why there is none is looked into by a thread."""

    def __init__(
        self,
        connect: Sequence[str],
        certificates: Certificates | None,
        explain: Callable[[str, Certificates | None], Finding] | None = None,
    ) -> None:
        self._connect = connect
        self._certificates = CertificateWatch(certificates) if certificates is not None else None
        self._folder = certificates
        self._explain = explain or _why_unanswered
        self._linked: bool | None = None
        self._missing_since_s: float | None = None
        self._explained_s = -float("inf")
        self._thread: threading.Thread | None = None
        self._found: list[Finding] = []

    def turn(self, linked: bool, monotonic_s: float, now_s: float) -> list[Line]:
        """What is to be said now. Called about once a second."""
        lines: list[Line] = []
        if self._connect and linked != self._linked:
            where = ", ".join(self._connect)
            lines.append((logging.INFO, f"linked to {where}") if linked else (logging.WARNING, f"no link yet to {where}"))
        self._linked = linked
        lines += self._reasons(linked, monotonic_s)
        found = self._certificates.turn(monotonic_s, now_s) if self._certificates is not None else None
        return [*lines, _line(found)] if found is not None else lines

    def _reasons(self, linked: bool, monotonic_s: float) -> list[Line]:
        """A link that is missing for a while is worth a look: Zenoh does not say who refuses whom."""
        if linked or not self._connect:
            self._missing_since_s = None
            self._found.clear()
            return []
        if self._missing_since_s is None:
            self._missing_since_s = monotonic_s
        found, self._found = self._found, []
        long_missing = monotonic_s - self._missing_since_s >= EXPLAIN_AFTER_S
        if long_missing and monotonic_s - self._explained_s >= EXPLAIN_EVERY_S and not self._is_looking():
            self._explained_s = monotonic_s
            self._thread = threading.Thread(target=self._look, daemon=True, name="why-unanswered")
            self._thread.start()
        return [_line(item) for item in found]

    def _is_looking(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _look(self) -> None:
        self._found = [self._explain(self._connect[0], self._folder)]


def _line(found: Finding) -> Line:
    return logging.ERROR if found.level == "wrong" else logging.WARNING, say(found)


def say(found: Finding) -> str:
    """A finding in one line."""
    return f"{found.what}; {found.advice}" if found.advice else found.what


def _version(file: Path) -> int:
    """When a file was last changed; 0 where there is none to be seen."""
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return 0


def _why_unanswered(endpoint: str, certificates: Certificates | None) -> Finding:
    # Here, for it needs `ssl`, and a router that is linked does not.
    from .unanswered import why_unanswered  # noqa: PLC0415

    return why_unanswered(endpoint, certificates if is_guarded(endpoint) else None)
