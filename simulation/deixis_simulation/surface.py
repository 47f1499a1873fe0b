"""A shape with its look: what rooms, furniture and exhibits are made of."""

from __future__ import annotations

from dataclasses import dataclass, replace

from .scene import Tone
from .shapes import Shape, Vector, placed
from .textures import Picture


@dataclass(frozen=True)
class Surface:
    """A shape with its look. `texture` None: white; tint multiplies it (linear); `emission` is light of its own."""

    shape: Shape
    texture: Picture | None = None
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    roughness: float = 0.8
    gloss: float = 0.1
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    casts_shadow: bool = True

    def placed(self, centre: Vector, turn_deg: float = 0.0) -> Surface:
        """The same, turned about the vertical through its origin, then moved."""
        return replace(self, shape=placed(self.shape, centre, turn_deg))


def linear_tint(tone: Tone) -> tuple[float, float, float]:
    """A display colour as a factor of linear light."""
    red, green, blue = ((value / 255) ** 2.2 for value in tone)
    return red, green, blue
