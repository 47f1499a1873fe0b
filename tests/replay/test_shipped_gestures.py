"""The gesture core on the tracks of the shipped clips, at their own rate and at a third of it."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from deixis_evaluation.clips import TruePerson, load_clips
from deixis_evaluation.references import read_reference
from deixis_evaluation.replay import REPLAYS, Given
from deixis_schemas.messages import Gesture, Gestures

CLIPS = {clip.name: clip for clip in load_clips(Path(__file__).parents[2] / "examples" / "clips")}
REFERENCES = Path(__file__).parent / "references"
POINTING = ("point_left", "point_right", "invisible")
SETTLED_S = 0.45
"""A stroke is known to be one after it has been held for some time."""


def gestures(name: str, every: int) -> Sequence[tuple[TruePerson, float, Gesture]]:
    """(truth, seconds, what is said) of the one person, in every so many frames of a clip."""
    clip = CLIPS[name]
    given = Given(clip, read_reference(REFERENCES, name, "tracker")[::every])
    said = [message for message in REPLAYS["gesture"](given) if isinstance(message, Gestures)]
    return [
        (clip.truth.frames[message.seq].persons[0], message.seq / clip.truth.meta.fps, gesture)
        for message in said
        for gesture in message.gestures
    ]


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize(("name", "expected", "hand"), [("pointing", "point_right", "right"), ("small", "point_left", "left")])
def test_a_pointing_is_recognised_through_its_stroke_at_its_bearing(name: str, expected: str, hand: str, every: int) -> None:
    answers = gestures(name, every)
    began_s = next(at_s for truth, at_s, _ in answers if truth.points)
    settled = [(truth, said) for truth, at_s, said in answers if truth.points and at_s > began_s + SETTLED_S]
    assert len(settled) >= 5
    assert {(said.phase, said.gesture, said.hand) for _, said in settled} == {("stroke", expected, hand)}
    truth, said = settled[-1]
    assert abs(said.bearing_deg - truth.poi_azimuth_deg) < 2 * said.bearing_sigma_deg
    assert not [
        truth.phase for truth, _, said in answers if said.gesture in POINTING and truth.phase in ("none", "preparation")
    ]


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize("name", ["wave", "head_turn"])
def test_what_is_no_pointing_is_never_called_one(name: str, every: int) -> None:
    assert not [said.gesture for _, _, said in gestures(name, every) if said.gesture in POINTING]
