"""A robot's points of interest, its pose and its people as they are now, kept for those who look on and edit."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any, Protocol

from deixis_schemas.messages import Poi, State

from .gets import get_pois, get_state
from .poi_registry import EditRefused, NoAnswer, PoiRegistry

LOOK_TIMEOUT_S = 1.0
# Of each list in fusion's state: only the first of them is drawn.
ROWS = 1


class PoiStore(Protocol):
    """Where edits go and what is there, as `poi_requests` needs it."""

    def snapshot(self) -> Snapshot:
        """What was seen last."""

    def add(self, poi: Poi) -> Poi:
        """Put a POI whose id is new; the stored one. Raises EditRefused, NoAnswer."""

    def put(self, poi: Poi) -> Poi:
        """Add or replace a POI; the stored one. Raises EditRefused, NoAnswer."""

    def delete(self, poi_id: str) -> Poi:
        """Remove a POI; it as it was. Raises EditRefused, NoAnswer."""


@dataclass(frozen=True)
class Snapshot:
    """What was seen last. trouble: why it may be out of date, as a sentence; pois: by id; version: changes with them."""

    version: str
    pois: dict[str, Poi]
    state: State | None
    trouble: str

    def live(self) -> dict[str, Any]:
        """Pose, people and trouble, for JSON."""
        pose = self.state.robot_pose if self.state else None
        return {
            "version": self.version,
            "trouble": self.trouble,
            "robot_pose": [pose.x_m, pose.y_m, pose.yaw_deg] if pose else None,
            "persons": [
                {
                    "person_id": person.person_id,
                    "position_m": person.position_m,
                    "points_at": person.credible[0] if person.episode_id and person.credible else None,
                }
                for person in (self.state.persons if self.state else ())
                if person.position_m is not None
            ],
        }


class PoiLink:
    """Looks at a robot's fusion and edits its registry. `look` is for one thread, all else for any."""

    def __init__(self, registry: PoiRegistry) -> None:
        """Nothing is seen until the first `look`."""
        self._registry = registry
        self._lock = threading.Lock()
        self._pois: dict[str, Poi] = {}
        self._state: State | None = None
        self._trouble = "fusion was not asked yet"
        self._seen: tuple[str, int] | None = None
        self._changes = 0

    def look(self) -> None:
        """Ask fusion how it is, and for the POIs where they have changed since. Takes a few seconds where it is silent."""
        state = get_state(self._registry.session, self._registry.robot, LOOK_TIMEOUT_S, rows=ROWS)
        if state is None:
            with self._lock:
                self._state, self._trouble, self._seen = None, self._why_silent(), None
            return
        # Each edit counts there, whoever makes it; a fusion that began anew has another name.
        standing = (state.instance, state.edits_accepted)
        with self._lock:
            self._state, self._trouble = state, ""
            current, changes = standing == self._seen, self._changes
        if not current:
            self._take(standing, changes)

    def _take(self, standing: tuple[str, int], changes: int) -> None:
        pois = get_pois(self._registry.session, self._registry.robot)
        with self._lock:
            # An edit of ours in the meantime may not be among them: the next look asks again.
            if pois is None or changes != self._changes:
                return
            self._seen = standing
            taken = {poi.poi_id: poi for poi in pois}
            if taken != self._pois:
                self._pois, self._changes = taken, self._changes + 1

    def snapshot(self) -> Snapshot:
        """What was seen last."""
        with self._lock:
            return Snapshot(str(self._changes), self._pois, self._state, self._trouble)

    def add(self, poi: Poi) -> Poi:
        """Put a POI whose id is new; the stored one. Raises EditRefused, NoAnswer."""
        self._check_answers()
        if self._registry.pois(poi.poi_id):
            raise EditRefused(f"poi_id: there is a POI '{poi.poi_id}' already")
        return self._kept(self._registry.put(poi))

    def put(self, poi: Poi) -> Poi:
        """Add or replace a POI; the stored one. Raises EditRefused, NoAnswer."""
        self._check_answers()
        return self._kept(self._registry.put(poi))

    def delete(self, poi_id: str) -> Poi:
        """Remove a POI; it as it was. Raises EditRefused, NoAnswer."""
        self._check_answers()
        gone = self._registry.delete(poi_id)
        with self._lock:
            self._pois = {known: poi for known, poi in self._pois.items() if known != poi_id}
            self._changes += 1
        return gone

    def _kept(self, poi: Poi) -> Poi:
        with self._lock:
            self._pois = {**self._pois, poi.poi_id: poi}
            self._changes += 1
        return poi

    def _check_answers(self) -> None:
        """Who edits is told at once of a router or fusion that was silent at the last look. Raises NoAnswer."""
        with self._lock:
            trouble = self._trouble
        if trouble or not self._linked():
            raise NoAnswer(trouble or self._why_silent())

    def _linked(self) -> bool:
        return bool(self._registry.session.info.routers_zid())

    def _why_silent(self) -> str:
        if not self._linked():
            return f"the router at {self._registry.connect} is gone; waiting for it"
        return f"fusion of robot '{self._registry.robot}' does not answer; waiting for it"
