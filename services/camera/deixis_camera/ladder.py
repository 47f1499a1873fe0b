"""What the camera can send less of, as a ladder: first JPEG quality, then frames a second. Pure.

Quality goes first, down to where answers would change (`least_quality`): it costs nothing that anybody sees. The picture's size
stays: a tracker that gets another size begins anew, so a size that follows the link would cost the tracks each time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

QUALITIES = (95, 85, 75, 65, 50, 35, 20)
RATE_SHARES = (1.0, 2 / 3, 1 / 2, 1 / 3, 1 / 4, 1 / 6, 1 / 10, 1 / 15, 1 / 30)
# Bytes of a JPEG by quality, beside those at 85: means over the shipped clips (640 x 480), which differ by a tenth.
BYTES_BY_QUALITY = (
    (1, 0.14),
    (20, 0.27),
    (30, 0.35),
    (40, 0.40),
    (50, 0.46),
    (65, 0.58),
    (75, 0.72),
    (85, 1.0),
    (95, 1.93),
    (100, 4.0),
)


@dataclass(frozen=True)
class Rung:
    """Quality of the JPEGs (None: raw pictures) and the most frames a second (0: as many as the source gives)."""

    quality: int | None
    rate_hz: float

    def frame_bytes(self, size: float, at_quality: int | None) -> float:
        """Bytes of a frame to expect here, from the size of frames at some other quality."""
        if self.quality is None or at_quality is None:
            return size
        return size * relative_bytes(self.quality) / relative_bytes(at_quality)


def ladder(quality: int | None, least_quality: int, rate_hz: float, least_rate_hz: float) -> tuple[Rung, ...]:
    """All rungs, the best first, each of fewer bytes than the one before.

    From `quality` (None: raw pictures, which have none) at `rate_hz` down to `least_quality`, then to `least_rate_hz`. A limit
    that is not below where it starts changes nothing.
    """
    qualities: Sequence[int | None] = (None,)
    if quality is not None:
        between = [step for step in QUALITIES if least_quality < step < quality]
        qualities = list(dict.fromkeys([quality, *between, min(quality, least_quality)]))
    least_hz = min(rate_hz, least_rate_hz)
    rates = [rate_hz * share for share in RATE_SHARES if rate_hz * share > least_hz]
    at_full_rate = [Rung(step, rate_hz) for step in qualities]
    return (*at_full_rate, *(Rung(qualities[-1], rate) for rate in [*rates, least_hz] if rate < rate_hz))


def relative_bytes(quality: int) -> float:
    """Bytes of a JPEG of this quality (1 to 100) beside those of one of 85."""
    for (low, fewer), (high, more) in pairwise(BYTES_BY_QUALITY):
        if low <= quality <= high:
            return fewer + (more - fewer) * (quality - low) / (high - low)
    raise ValueError(f"quality: {quality} is not between 1 and 100")
