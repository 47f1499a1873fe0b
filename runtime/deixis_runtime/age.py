"""How old a message of a frame is when it is taken, by clocks that are not ours. Pure: values and times in, an age out."""

from __future__ import annotations

BUCKET_NS = 15 * 10**9


class RelativeAge:
    """Age beyond what messages of one key usually need from their capture to us.

    Clocks of hosts differ and step, so a stamp alone tells no age. The delay of a message is its receipt on our monotonic
    clock less its stamp: that holds the clocks' difference, the same in all. The shortest delay of the last 15 to 30 s is
    taken for one without waiting. A backlog, as a cut link gives out when it is mended, shows by longer ones.
    """

    def __init__(self) -> None:
        self._run: int | None = None
        self._seq = -1
        self._stamp_ns = 0
        self._bucket_began_ns = 0
        self._shortest_ns: int | None = None
        self._shortest_before_ns: int | None = None

    def note(self, run: int, seq: int, stamp_ns: int, received_ns: int) -> bool:
        """A message came: its frame's `run`, `seq` and stamp (the sender's clock), and when (our monotonic clock).

        True where it shows that the sender's clock was set back.
        """
        clock_set_back = run == self._run and seq > self._seq and stamp_ns < self._stamp_ns
        if run != self._run or clock_set_back:  # another run may be one of another clock
            self._shortest_ns = self._shortest_before_ns = None
            self._bucket_began_ns = received_ns
        elif received_ns - self._bucket_began_ns >= BUCKET_NS:
            self._shortest_before_ns, self._shortest_ns = self._shortest_ns, None
            self._bucket_began_ns = received_ns
        self._run, self._seq, self._stamp_ns = run, seq, stamp_ns
        delay_ns = received_ns - stamp_ns
        self._shortest_ns = delay_ns if self._shortest_ns is None else min(self._shortest_ns, delay_ns)
        return clock_set_back

    def age_s(self, stamp_ns: int, now_ns: int) -> float:
        """Age at `now_ns` of a message that was noted, seconds."""
        known = [delay_ns for delay_ns in (self._shortest_ns, self._shortest_before_ns) if delay_ns is not None]
        return (now_ns - stamp_ns - min(known)) / 1e9 if known else 0.0
