"""Which true person each tracked one is, frame by frame while a clip is played: by where the face track lies, and by memory."""

from __future__ import annotations

import math

from deixis_schemas.messages import Track, Tracks

from .clips import TrueFrame, TruePerson, Truth
from .matching import finds_face

NEAR_FACE_WIDTHS = 0.8
"""A face track this near to a head's centre is that head's, also where the face is turned away."""


class TrackedPersons:
    """Follows which true person each `person_id` of the tracker is."""

    def __init__(self, truth: Truth) -> None:
        self._truth = truth
        self._known: dict[int, int] = {}

    def match(self, tracks: Tracks) -> dict[int, TruePerson]:
        """The true persons of this frame by the `person_id` of its tracks; whose face never lay on anybody is left out."""
        if tracks.seq >= len(self._truth.frames):
            return {}
        frame = self._truth.frames[tracks.seq]
        for track in tracks.tracks:
            if track.kind == "face" and track.person_id is not None:
                self._note(track.person_id, track, frame)
        by_id = {person.id: person for person in frame.persons}
        present = sorted({track.person_id for track in tracks.tracks if track.person_id is not None})
        return {own: by_id[self._known[own]] for own in present if self._known.get(own) in by_id}

    def _note(self, own: int, track: Track, frame: TrueFrame) -> None:
        near = [(self._distance(track, person), person.id) for person in frame.persons if self._is_on(track, person)]
        if near:
            self._known[own] = min(near)[1]

    def _is_on(self, track: Track, person: TruePerson) -> bool:
        return finds_face(track, person, self._truth) or self._distance(track, person) <= NEAR_FACE_WIDTHS

    def _distance(self, track: Track, person: TruePerson) -> float:
        """From the track to the head's centre, face widths."""
        return math.dist(track.centroid_px, person.head.center_px) / self._truth.face_width_px(person)
