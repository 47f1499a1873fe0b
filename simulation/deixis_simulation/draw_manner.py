"""What scenes are drawn from: all that may be met with, or plain ones."""

from __future__ import annotations

from dataclasses import dataclass

from .draw_actions import ANY_HABITS, Habits
from .draw_bodies import CHILD_SHARE
from .draw_lens import ANY_OPTICS, Optics
from .draw_light import ANY_LAMPS, Lamps
from .draw_mount import ANY_MOUNTS, Mounts
from .draw_plan import ANY_PLOTS, Plots
from .draw_pois import ANY_SPREAD, Spread
from .draw_room import ANY_ROOMS, Rooms
from .draw_stand import ANY_STANDS, Stands


@dataclass(frozen=True)
class Manner:
    """What each part of a scene is drawn from; by default from all that may be met with. `letter` begins the scene's name."""

    letter: str = "s"
    child_share: float = CHILD_SHARE
    plots: Plots = ANY_PLOTS
    stands: Stands = ANY_STANDS
    spread: Spread = ANY_SPREAD
    habits: Habits = ANY_HABITS
    mounts: Mounts = ANY_MOUNTS
    optics: Optics = ANY_OPTICS
    lamps: Lamps = ANY_LAMPS
    rooms: Rooms = ANY_ROOMS


ANYHOW = Manner()
