"""The true gesture in place of the gesture stage: phase, side and bearing of the arm, for the persons that are tracked."""

from __future__ import annotations

from collections.abc import Sequence

from deixis_fusion.config import HandConfig
from deixis_gesture.bearing import LEAST_SIGMA_DEG
from deixis_schemas import topics
from deixis_schemas.messages import Gesture, GestureKind, Gestures, Message, Phase, Tracks

from .clips import TruePerson, Truth, TruthPhase
from .speaker import producer_of
from .tracked_persons import TrackedPersons

PHASES: dict[TruthPhase, Phase] = {
    "none": "idle",
    "preparation": "preparation",
    "stroke": "stroke",
    "retraction": "retraction",
}
SIDEWAYS = HandConfig()
"""Bearings at which fusion expects a hand to be recognised; in front and behind of these a pointing is `invisible`."""


class TrueGestures:
    """Answers each Tracks with the true Gestures."""

    topic = topics.GESTURES

    def __init__(self, truth: Truth) -> None:
        self._persons = TrackedPersons(truth)

    def begin(self) -> Sequence[Message]:
        """Nothing: there is no frame yet."""
        return ()

    def hear(self, message: Message) -> Sequence[Message]:
        """The gestures of the persons tracked."""
        if not isinstance(message, Tracks):
            return ()
        gestures = [gesture_of(own, person) for own, person in self._persons.match(message).items()]
        return (Gestures.derive(message, producer_of(self.topic), gestures=gestures),)


def gesture_of(own: int, person: TruePerson) -> Gesture:
    """What the true person does, said of the tracked one `own`."""
    phase = PHASES[person.phase if person.phase != "none" else (person.nonpoint_phase or "none")]
    if phase == "idle":
        return Gesture(person_id=own, phase="idle", gesture="none")
    if not person.points:
        kind: GestureKind = "other" if phase == "stroke" else "none"
        return Gesture(person_id=own, phase=phase, gesture=kind, hand=person.arm.side)
    azimuth = person.poi_azimuth_deg or 0.0
    # Labels of the shipped clips do not tell where the arm points; there the POI's own bearing stands in.
    bearing = person.arm.eye_tip_azimuth_deg if person.arm.eye_tip_azimuth_deg is not None else azimuth
    return Gesture(
        person_id=own,
        phase=phase,
        gesture=_pointing(azimuth),
        hand=person.arm.side,
        fingertips_px=_fingertips(person),
        bearing_deg=bearing,
        bearing_sigma_deg=LEAST_SIGMA_DEG,
    )


def _pointing(azimuth_deg: float) -> GestureKind:
    if not SIDEWAYS.min_deg <= abs(azimuth_deg) <= SIDEWAYS.max_deg:
        return "invisible"
    return "point_left" if azimuth_deg > 0 else "point_right"


def _fingertips(person: TruePerson) -> list[tuple[float, float]]:
    hand = next((hand for side, hand in person.hands.sides() if side == person.arm.side), None)
    return [hand.index_tip_px] if hand is not None and hand.in_frame and hand.index_tip_px is not None else []
