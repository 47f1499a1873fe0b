"""Sentences of advice: what of the site, and of where people stand in it, is in the way of an answer."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .aims import SMALL_FACE_PX, Aim, ClosePair, Hidden, close_pairs, face_px
from .answers import Cause
from .confusion import Confusion, PoiResult
from .ground import FARTHEST_M, Ground, GroundPoi
from .places import Place

Topic = Literal[
    "close", "wall", "behind", "far", "here", "beyond_reach", "hand_outside", "small", "confused", "false", "failed"
]
CAUSES: dict[Cause, str] = {
    "hand_outside": "the pointing hand leaves the picture",
    "small": "the person is too small in the picture",
    "close": "what was answered lies next to it",
    "not_seen": "the gesture was not seen as pointing",
    "beyond_reach": "the head turns beyond its range, where only its side is told",
    "head_off": "the head's pose was misread",
    "hand_off": "the hand's direction was misread",
    "looked_away": "the person did not look where the hand pointed",
    "unclear": "hand and head spoke for several",
}
HIDDEN: dict[Hidden, str] = {
    "wall": "stands behind a wall",
    "behind": "lies at the back of people who face the robot",
    "here": "stands where the person stands",
}
MOST_OTHERS = 3
MOST_CLOSE = 12
"""Close pairs that are spoken of; how many more there are is said."""


@dataclass(frozen=True)
class Advice:
    """One sentence, what it is about, and the POIs and places it speaks of (ids, letters)."""

    topic: Topic
    text: str
    pois: tuple[str, ...] = ()
    places: tuple[str, ...] = ()


def advise(ground: Ground, aims: Sequence[Aim], confusion: Confusion | None) -> list[Advice]:
    """What to know, the gravest first. Without `confusion` only what the geometry says."""
    said = [*_hidden(ground, aims), *_pairs(aims, confusion), *_pictures(ground, aims)]
    if confusion is None:
        return said
    return [*_failures(confusion), *_false(confusion), *_results(confusion), *said]


def instead(result: PoiResult, names: dict[str, str]) -> str:
    """What was answered besides the POI, the most frequent first: 'the clock 2, nothing 1'."""
    parts = [f"{names.get(other, other)} {times}" for other, times in result.confused_with.most_common(MOST_OTHERS)]
    if len(result.confused_with) > MOST_OTHERS:
        parts.append("others")
    if result.outcomes["missed"]:
        parts.append(f"nothing {result.outcomes['missed']}")
    return ", ".join(parts)


def _hidden(ground: Ground, aims: Sequence[Aim]) -> list[Advice]:
    """POIs that nobody, or not everybody, points at."""
    far = f"is more than {FARTHEST_M:g} m from the robot and is not tried: is its position right?"
    advice = [Advice("far", f"{_capital(poi.name)} {far}", (poi.poi_id,)) for poi in ground.too_far]
    for poi, views in _by_poi(aims).items():
        for why, words in HIDDEN.items():
            places = [aim.place for aim in views if aim.hidden == why]
            if places:
                advice.append(Advice(why, _hidden_text(poi, words, places, len(views)), (poi.poi_id,), _letters(places)))
    return advice


def _hidden_text(poi: GroundPoi, words: str, places: Sequence[Place], views: int) -> str:
    if len(places) == views and views > 1:
        return f"{_capital(poi.name)} {words} from all places: nobody points at it where the camera sees people."
    return f"Seen from {_and([place.words for place in places])}, {poi.name} {words}: nobody points at it from there."


def _pairs(aims: Sequence[Aim], confusion: Confusion | None) -> list[Advice]:
    """Each pair of POIs too close together once, with the place where they are closest."""
    grouped: dict[tuple[str, str], list[ClosePair]] = defaultdict(list)
    for pair in close_pairs(aims):
        grouped[pair.first.poi_id, pair.second.poi_id].append(pair)
    advice = [_pair(pairs, confusion) for pairs in grouped.values()]
    if len(advice) > MOST_CLOSE:
        more = f"{len(advice) - MOST_CLOSE} more pairs of POIs lie as close together; the JSON file (--json) names them all."
        return [*advice[:MOST_CLOSE], Advice("close", more)]
    return advice


def _pair(pairs: Sequence[ClosePair], confusion: Confusion | None) -> Advice:
    pair = pairs[0]
    others = f" (and from {_and([other.place.words for other in pairs[1:]])})" if len(pairs) > 1 else ""
    where = (
        f"{_capital(pair.first.name)} and {pair.second.name} lie {pair.gap_deg:.0f}° apart seen from {pair.place.words}{others}"
    )
    ids = (pair.first.poi_id, pair.second.poi_id)
    text = f"{where}: move one, or accept a tie."
    if confusion is not None and not any({a, b} == set(ids) for a, b, _ in confusion.confused_pairs()):
        text = f"{where}; they were not confused this time, but have little to spare."
    return Advice("close", text, ids, _letters([item.place for item in pairs]))


def _pictures(ground: Ground, aims: Sequence[Aim]) -> list[Advice]:
    """What the picture does not show well, place by place."""
    places = dict.fromkeys(aim.place for aim in aims)
    made = [make(ground, place, aims) for place in places for make in (_outside, _turned, _small)]
    return [advice for advice in made if advice is not None]


def _outside(ground: Ground, place: Place, aims: Sequence[Aim]) -> Advice | None:
    pois = [aim.poi for aim in aims if aim.place == place and aim.hidden is None and not aim.hand_in_picture]
    if not pois:
        return None
    text = (
        f"Who points at {_and([poi.name for poi in pois])} from {place.words} holds the fingertip out of the picture "
        f"({ground.camera.horizontal_fov_deg:.0f}° wide), so only the head tells: stand farther from the camera or more to its "
        "middle, or take a wider lens."
    )
    return Advice("hand_outside", text, _ids(pois), (place.letter,))


def _turned(ground: Ground, place: Place, aims: Sequence[Aim]) -> Advice | None:
    turned = [aim for aim in aims if aim.place == place and aim.hidden is None and aim.beyond_reach]
    if not turned:
        return None
    seen = _and([f"{aim.poi.name} ({abs(aim.azimuth_deg):.0f}°)" for aim in turned])
    verb = "lie" if len(turned) > 1 else "lies"
    text = (
        f"{_capital(seen)} {verb} beyond {ground.head_range_deg:g}° from the line to the camera seen from "
        f"{place.words}: out there the head's pose is not told, only its side."
    )
    return Advice("beyond_reach", text, _ids([aim.poi for aim in turned]), (place.letter,))


def _small(ground: Ground, place: Place, _: Sequence[Aim]) -> Advice | None:
    width = face_px(ground, place)
    if width >= SMALL_FACE_PX:
        return None
    text = (
        f"A face at {place.words} is {width:.0f} pixels wide, near the smallest that is found: take more pixels, a "
        "narrower lens, or stand nearer."
    )
    return Advice("small", text, (), (place.letter,))


def _results(confusion: Confusion) -> list[Advice]:
    """Why POIs are not told apart."""
    names = {result.poi.poi_id: result.poi.name for result in confusion.results}
    return [_result(result, names) for result in confusion.results if result.verdict in ("tied", "confused")]


def _result(result: PoiResult, names: dict[str, str]) -> Advice:
    named = f"{_capital(result.poi.name)} was named {result.outcomes['named']} of {result.tries} times"
    why = ", ".join(f"{CAUSES[cause]} ({times})" for cause, times in result.causes.most_common())
    text = f"{named}; answered instead: {instead(result, names)}. Why: {why}."
    return Advice("confused", text, (result.poi.poi_id, *result.confused_with))


def _false(confusion: Confusion) -> list[Advice]:
    advice = []
    if confusion.quiet_answered:
        text = f"An answer was given to people who did not point in {confusion.quiet_answered} of {confusion.quiet} trials."
        advice.append(Advice("false", text))
    extra = confusion.extra_answers
    if extra:
        advice.append(Advice("false", f"{extra} answer{'s' if extra > 1 else ''} came besides those to the pointings."))
    return advice


def _failures(confusion: Confusion) -> list[Advice]:
    """Each reason once."""
    reasons = Counter(why for _, why in confusion.failures)
    return [Advice("failed", f"{number} of the clips could not be tried: {why}.") for why, number in reasons.most_common()]


def _by_poi(aims: Sequence[Aim]) -> dict[GroundPoi, list[Aim]]:
    found: dict[GroundPoi, list[Aim]] = defaultdict(list)
    for aim in aims:
        found[aim.poi].append(aim)
    return found


def _ids(pois: Sequence[GroundPoi]) -> tuple[str, ...]:
    return tuple(poi.poi_id for poi in pois)


def _letters(places: Sequence[Place]) -> tuple[str, ...]:
    return tuple(place.letter for place in places)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _and(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
