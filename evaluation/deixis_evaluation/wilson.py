"""How sure a share is: few strokes say little."""

from __future__ import annotations

import math

Z_95 = 1.959964
"""Of a normal distribution, 95 % within."""


def wilson(hits: int, total: int, z: float = Z_95) -> tuple[float, float] | None:
    """Wilson's score interval of the share `hits / total`; none where there was nothing. Raises ValueError for other counts."""
    if not 0 <= hits <= max(total, 0):
        raise ValueError(f"{hits} of {total} is no share")
    if total == 0:
        return None
    share, spread = hits / total, z * z / total
    middle = (share + spread / 2) / (1 + spread)
    half = z / (1 + spread) * math.sqrt(share * (1 - share) / total + spread / (4 * total))
    return max(0.0, middle - half), min(1.0, middle + half)
