"""What strokes are sorted by, to see where they fail: a trait gives a stroke a word, or none where its clip does not tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

from .clips import Clip, TrueAction, TrueActor, Truth
from .episode_scores import EpisodeScore

NEAR_M, FAR_M = 1.7, 2.6
DARK_BELOW_DEG, LIGHT_ABOVE_DEG = -30.0, 41.0
"""Skin tones by their ITA, as FORMAT.md has them."""
ADULT_M = 1.5


@dataclass(frozen=True)
class Asked:
    """One true stroke with its clip."""

    clip: Clip
    stroke: EpisodeScore

    @property
    def truth(self) -> Truth:
        """The clip's labels."""
        return self.clip.truth

    @property
    def actor(self) -> TrueActor | None:
        """The person in the scene that the clip was rendered from; none where there is no scene."""
        people = self.truth.meta.scene.people if self.truth.meta.scene else []
        return people[self.stroke.person] if self.stroke.person < len(people) else None

    @property
    def action(self) -> TrueAction | None:
        """The pointing of the scene that the stroke belongs to."""
        middle_s = sum(self.stroke.frames) / 2 / self.truth.meta.fps
        pointings = [action for action in (self.actor.actions if self.actor else []) if action.type == "point"]
        return next((action for action in pointings if action.start_s <= middle_s <= action.end_s), None)


def _kind(asked: Asked) -> str | None:
    return asked.truth.meta.kind


def _distance(asked: Asked) -> str | None:
    first, last = asked.stroke.frames
    persons = (person for frame in asked.truth.frames[first : last + 1] for person in frame.persons)
    away = median(person.user_pos.distance_m for person in persons if person.id == asked.stroke.person)
    if away < NEAR_M:
        return f"below {NEAR_M:g} m"
    return f"{NEAR_M:g} to {FAR_M:g} m" if away <= FAR_M else f"above {FAR_M:g} m"


def _azimuth(asked: Asked) -> str | None:
    limits = (("0 to 30 deg", 30.0), ("30 to 60 deg", 60.0), ("60 to 90 deg", 90.0))
    return next((name for name, limit in limits if abs(asked.stroke.azimuth_deg) < limit), "90 deg and more")


def _skin(asked: Asked) -> str | None:
    tones = {person.id: person.face_ITA_deg for person in asked.truth.meta.persons}
    tone = tones.get(asked.stroke.person)
    if tone is None:
        return None
    return "dark" if tone < DARK_BELOW_DEG else "light" if tone > LIGHT_ABOVE_DEG else "medium"


def _width(asked: Asked) -> str | None:
    return f"{asked.truth.meta.width} px"


def _view(asked: Asked) -> str | None:
    fov = asked.truth.meta.horizontal_fov_deg
    return "below 60 deg" if fov < 60 else "60 to 75 deg" if fov <= 75 else "above 75 deg"


def _camera(asked: Asked) -> str | None:
    return "moves" if asked.truth.moves else "stands"


def _arm(asked: Asked) -> str | None:
    return asked.action.style if asked.action else None


def _hand(asked: Asked) -> str | None:
    return asked.action.hand if asked.action else None


def _looks(asked: Asked) -> str | None:
    return asked.action.looks if asked.action else None


def _height(asked: Asked) -> str | None:
    if asked.actor is None:
        return None
    return f"child (below {ADULT_M:g} m)" if asked.actor.height_m < ADULT_M else "adult"


TRAITS: dict[str, Callable[[Asked], str | None]] = {
    "kind": _kind,
    "distance": _distance,
    "azimuth": _azimuth,
    "skin": _skin,
    "width": _width,
    "field_of_view": _view,
    "camera": _camera,
    "arm": _arm,
    "hand": _hand,
    "looks_at": _looks,
    "height": _height,
}
"""In the order of the table."""
