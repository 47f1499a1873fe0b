"""What became of a trial: the answer to it, and why it was not the POI that was meant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from deixis_evaluation.clip_score import ClipScore
from deixis_evaluation.clips import TruePerson, Truth
from deixis_evaluation.episode_scores import EpisodeScore, Outcome

from ..geometry import wrap_deg
from .aims import CLOSE_DEG, SMALL_FACE_PX, Aim

Cause = Literal["hand_outside", "small", "close", "not_seen", "beyond_reach", "head_off", "hand_off", "looked_away", "unclear"]
"""Why a POI was not named: the pointing hand left the picture; the person is too small in it; the answer lies within CLOSE_DEG
of what was meant; no pointing was seen; the head is turned beyond its range; the head's yaw, or the hand's bearing or side, is
wrong; the person did not look where the hand points; the evidence spoke for several."""

OFF_DEG = 15.0
"""An error of head or hand that another POI may lie within."""
AWAY_DEG = 25.0
"""A head turned so much less or more than the hand looks elsewhere."""
INSIDE_SHARE = 0.5
"""A hand that is in the picture in less of its stroke has left it."""


@dataclass(frozen=True)
class Answer:
    """What the system said to one trial.

    asked: the POI that was pointed at, none in a quiet trial. poi_ids: the answer, empty where there was none. outcome: none in
    a quiet trial and where `failure` says why the clip could not be played. cause: none where the POI was named.
    false_answers: what was answered though nobody pointed.
    """

    trial: str
    place: str
    asked: str | None
    poi_ids: tuple[str, ...] = ()
    outcome: Outcome | None = None
    cause: Cause | None = None
    false_answers: tuple[tuple[str, ...], ...] = ()
    failure: str | None = None


def answer_of(trial: str, place: str, aim: Aim | None, aims: Sequence[Aim], score: ClipScore, truth: Truth) -> Answer:
    """The answer to a trial, from its clip's score and truth. `aims` are all POIs from the same place."""
    asked = aim.poi.poi_id if aim is not None else None
    if score.failure is not None:
        return Answer(trial, place, asked, failure=score.failure)
    false = tuple(item.poi_ids for item in score.answers.false_episodes)
    if aim is None:
        return Answer(trial, place, None, false_answers=false)
    episode = next((item for item in score.answers.episodes if item.poi == asked), None)
    if episode is None:
        return Answer(trial, place, asked, failure="the clip holds no stroke toward the POI")
    cause = None if episode.outcome == "named" else _cause(aim, aims, episode, truth)
    return Answer(trial, place, asked, episode.poi_ids, episode.outcome, cause, false)


def _cause(aim: Aim, aims: Sequence[Aim], episode: EpisodeScore, truth: Truth) -> Cause:
    """The first that applies, from what no change of the system would mend to what is its own error."""
    first, last = episode.frames
    strokes = [person for frame in truth.frames[first : last + 1] for person in frame.persons if person.points]
    answered = [other for other in aims if other.poi != aim.poi and other.poi.poi_id in episode.poi_ids]
    hand_off = episode.bearing_deg is not None and _apart_deg(episode.bearing_deg, episode.azimuth_deg) > OFF_DEG
    found: dict[Cause, bool] = {
        "hand_outside": _inside_share(strokes) < INSIDE_SHARE,
        "small": any(truth.face_width_px(person) < SMALL_FACE_PX for person in strokes),
        "close": any(_apart_deg(aim.azimuth_deg, other.azimuth_deg) < CLOSE_DEG for other in answered),
        "not_seen": not episode.answered,
        "beyond_reach": aim.beyond_reach,
        "head_off": episode.yaw_deg is not None and _apart_deg(episode.yaw_deg, episode.true_yaw_deg) > OFF_DEG,
        "hand_off": hand_off or episode.side == "wrong",
        "looked_away": _apart_deg(episode.true_yaw_deg, episode.azimuth_deg) > AWAY_DEG,
    }
    return next((cause for cause, holds in found.items() if holds), "unclear")


def _inside_share(strokes: Sequence[TruePerson]) -> float:
    """Part of the stroke in which the pointing hand is in the picture; 1 where the truth does not name the hand."""
    hands = [hand for person in strokes for side, hand in person.hands.sides() if side == person.arm.side]
    return sum(hand.in_frame for hand in hands) / len(hands) if hands else 1.0


def _apart_deg(one: float, other: float) -> float:
    return abs(wrap_deg(one - other))
