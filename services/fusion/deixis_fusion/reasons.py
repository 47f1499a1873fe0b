"""Why an answer was given, or none: one sentence for people."""

from __future__ import annotations

import numpy as np
from deixis_schemas.messages import MAX_TEXT, Poi

from .assessment import BEHIND_A_WALL, ROBOT_BLIND, Assessment
from .decision import Judgement
from .evidence import HandObservation, HeadObservation

NOTABLE_CONFLICT = 0.7
MAX_TITLE = 60
MAX_TIED_NAMED = 8
MAX_HIDDEN_NAMED = 3


def explain(told: Assessment) -> str:
    """Why: one plain sentence for people, which names the evidence."""
    evidence, judgement = told.evidence, told.judgement
    observed = f"The person {hand_words(evidence.hand)} and {head_words(evidence.head)}"
    robot = f"; robot/pose is in doubt: {told.doubt}" if told.doubt else ""
    if judgement is None:
        why = (
            f"no POI is in sight of the person{' and the robot' if len(told.robot_blind) else ''}"
            if told.place
            else "where the person stands is not known"
        )
        return cut(f"{observed}; no answer: {why}{_hidden(told)}{robot}.", MAX_TEXT)
    if not judgement.choice.hypotheses:
        return cut(f"{observed}; no answer: {judgement.choice.abstains}{_hidden(told)}{robot}.", MAX_TEXT)
    answer = f"{_answer_words(judgement)}{_runner_up(judgement)}{_doubt(judgement)}"
    return cut(f"{observed}; {answer}{_hidden(told)}{robot}.", MAX_TEXT)


def _hidden(told: Assessment) -> str:
    """Whom a wall hides from person or robot, the nearest first."""
    named = told.nearest_excluded(MAX_HIDDEN_NAMED)
    words = "".join(
        f"; {why}: {', '.join(names)}"
        for why in (BEHIND_A_WALL, ROBOT_BLIND)
        if (names := [f"'{title(poi)}'" for poi, reason in named if reason == why])
    )
    more = told.excluded_total - len(named)
    return f"{words} and {more} more" if more else words


def _answer_words(judgement: Judgement) -> str:
    chosen = judgement.choice.hypotheses
    names = [
        f"'{title(judgement.seen[i].poi)}' lies at {judgement.seen[i].bearing_deg:.0f} deg ({judgement.chances[i]:.2f})"
        for i in chosen[:MAX_TIED_NAMED]
    ]
    if len(chosen) == 1:
        return names[0]
    more = f" and {len(chosen) - len(names)} more" if len(chosen) > len(names) else ""
    return "tied are " + ", ".join(names) + more


def _runner_up(judgement: Judgement) -> str:
    rest = judgement.chances.copy()
    rest[list(judgement.choice.hypotheses)] = -1.0
    best = int(np.argmax(rest))
    if rest[best] < 0:
        return ""
    return f"; the next best is '{title(judgement.seen[best].poi)}' ({judgement.chances[best]:.2f})"


def _doubt(judgement: Judgement) -> str:
    conflict = judgement.contour_conflict
    return f"; hand and head disagree (contour conflict {conflict:.2f})" if conflict > NOTABLE_CONFLICT else ""


def title(poi: Poi) -> str:
    """What people call the POI, cut short where it is long."""
    return cut(poi.name or poi.poi_id, MAX_TITLE)


def cut(text: str, longest: int) -> str:
    """The text, with an ellipsis where it is longer than that."""
    return text if len(text) <= longest else text[: longest - 1] + "\N{HORIZONTAL ELLIPSIS}"


def hand_words(hand: HandObservation | None) -> str:
    """What the hand does."""
    if hand is None:
        return "shows no pointing hand"
    which = f"the {hand.hand} hand" if hand.hand else "a hand"
    if hand.gesture == "invisible":
        words = f"holds up {which} without a distinguishable finger"
    else:
        words = f"points to the {hand.gesture.removeprefix('point_')} with {which}"
    if hand.bearing_deg is None or hand.bearing_sigma_deg is None:
        return words
    mirror = f" or {hand.mirror_deg:.0f}" if hand.mirror_deg is not None else ""
    return f"{words} (about {hand.bearing_deg:.0f}{mirror} +- {hand.bearing_sigma_deg:.0f} deg)"


def head_words(head: HeadObservation | None) -> str:
    """What the head does."""
    if head is None:
        return "the head is not tracked"
    if head.yaw_deg is None:
        return f"the head is turned far{f' {head.side}' if head.side else ''}, out of range"
    if abs(head.yaw_deg) < 10:
        return "the head faces the camera"
    return f"the head is turned {abs(head.yaw_deg):.0f} deg {'left' if head.yaw_deg > 0 else 'right'}"
