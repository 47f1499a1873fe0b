"""When a picture was captured: by its header's stamp where that can be of this host's clock; and when a run ends. Pure."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Stamped:
    """stamp_ns: Unix nanoseconds; new_run: the source begins anew; complaint: why the header's stamp was not used."""

    stamp_ns: int
    new_run: bool
    complaint: str = ""


class Stamping:
    """Stamps the pictures of one camera."""

    def __init__(self, by_header: bool, most_off_s: float) -> None:
        """`by_header`: use the header's stamp, unless it is further than `most_off_s` from this host's clock."""
        self._by_header = by_header
        self._most_off_s = most_off_s
        self._header_ns: int | None = None
        self._stamp_ns = 0

    def stamp(self, header_ns: int, arrived_ns: int) -> Stamped:
        """The stamp of the next picture; stamps rise within a run.

        A header that goes back, as of a bag that is played again, begins another run.
        """
        back = self._header_ns is not None and header_ns < self._header_ns
        self._header_ns = header_ns
        complaint = self._complaint(header_ns, arrived_ns) if self._by_header else ""
        stamp_ns = header_ns if self._by_header and not complaint else arrived_ns
        if not back:
            stamp_ns = max(stamp_ns, self._stamp_ns + 1)
        self._stamp_ns = stamp_ns
        return Stamped(stamp_ns, back, complaint)

    def _complaint(self, header_ns: int, arrived_ns: int) -> str:
        if header_ns == 0:
            return "header.stamp is not set"
        off_s = (header_ns - arrived_ns) / 1e9
        if abs(off_s) <= self._most_off_s:
            return ""
        side = "ahead of" if off_s > 0 else "behind"
        return f"header.stamp is {abs(off_s):.1f} s {side} this host's clock (simulated time, a bag, or clocks that differ)"
