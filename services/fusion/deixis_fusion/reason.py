"""Why: one plain sentence for people, which names the evidence."""

from __future__ import annotations

from collections.abc import Sequence

from deixis_schemas.messages import Poi, Side

from .discernment import Candidate
from .evidence import HandObservation, HeadObservation
from .judgement import Judgement
from .witnesses import Witnesses

NOTABLE_CONFLICT = 0.7


def explain(judgement: Judgement | None, seen: Sequence[Candidate], witnesses: Witnesses, placed: bool) -> str:
    """The sentence for one answer. `judgement` is none where no POI came into question."""
    observed = f"The person {hand_words(witnesses.hand, witnesses.hand_side)} and {head_words(witnesses.head)}"
    if judgement is None:
        why = "no POI is in sight of the person" if placed else "where the person stands is not known"
        return f"{observed}; no answer: {why}."
    chosen = judgement.choice.hypotheses
    if not chosen:
        return f"{observed}; no answer: {judgement.choice.abstains}."
    pignistic = judgement.combination.belief.pignistic()
    names = [f"'{title(seen[i].poi)}' lies at {seen[i].bearing_deg:.0f} deg ({pignistic[i]:.2f})" for i in chosen]
    answer = names[0] if len(names) == 1 else "tied are " + ", ".join(names)
    return f"{observed}; {answer}{_runner_up(seen, chosen, pignistic)}{_doubt(judgement)}."


def _runner_up(seen: Sequence[Candidate], chosen: Sequence[int], pignistic: Sequence[float]) -> str:
    rest = [i for i in range(len(seen)) if i not in chosen]
    if not rest:
        return ""
    best = max(rest, key=lambda i: pignistic[i])
    return f"; the next best is '{title(seen[best].poi)}' ({pignistic[best]:.2f})"


def _doubt(judgement: Judgement) -> str:
    conflict = judgement.combination.conflict
    return f"; hand and head disagree (conflict {conflict:.2f})" if conflict > NOTABLE_CONFLICT else ""


def title(poi: Poi) -> str:
    """What people call the POI."""
    return poi.name or poi.poi_id


def hand_words(hand: HandObservation | None, hand_side: Side | None) -> str:
    """What the hand does."""
    if hand is None:
        return "shows no pointing hand"
    which = f"the {hand_side} hand" if hand_side else "a hand"
    if hand.gesture == "invisible":
        words = f"holds up {which} without a distinguishable finger"
    else:
        words = f"points to the {hand.gesture.removeprefix('point_')} with {which}"
    if hand.bearing_deg is None or hand.bearing_sigma_deg is None:
        return words
    mirror = f" or {180 - hand.bearing_deg:.0f}" if hand.mirrored else ""
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
