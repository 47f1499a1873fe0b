"""How well each POI explains what hand and head showed: the product of likelihoods, over where the person may stand."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from .config import HandConfig, HeadConfig
from .confusion import HandConfusion, table_1
from .curves import BEARINGS, Curve, Singles, at, bearing_curve, gesture_curve, head_curve
from .evidence import Evidence, HandObservation, HeadObservation, View
from .height import Heights, hand_likelihoods, head_likelihoods
from .localisation import PersonPlace
from .pointing import GESTURES
from .sight import CASES, FEW_BELOW_DEG, FEW_CASES, Indices, Sight

Values = npt.NDArray[np.float64]

NOTHING: Curve = np.zeros_like(BEARINGS)
# POIs at a time, from one place: what is reckoned on the way then stays in the processor's cache.
AT_A_TIME = 4096
MANY = 500
# The method of arrays takes twice as long for as few as there mostly are.
_largest = np.maximum.reduce


@dataclass(frozen=True, eq=False)
class Weighing:
    """Of each POI in sight (n): the likelihood of the hand, of the head and of both, and how well it fits.

    `hand` and `head` are each on their own the mean over the cases of `sight.py`; `joint` is the mean of their product, for
    hand and head are seen from one place. `fit` is what the POI explains in its best case, beside a POI that hung where it
    explained each best, 0 to 1: not relative to the other POIs, of which none may be what was meant. `head_floor` is the head's
    likelihood where it looks at something else.
    """

    hand: Values
    head: Values
    joint: Values
    fit: Values
    head_floor: float = 0.0

    @cached_property
    def contour_conflict(self) -> float:
        """1 - max_i (L1_i / max L1) (L2_i / max L2): 0 where one POI is the likeliest of both, at any number of POIs.

        The conflict of Dempster's rule says little: .5 with 20 POIs in perfect agreement, .85 in contradiction.
        """
        most = float(_largest(self.hand) * _largest(self.head))
        return 1 - float(_largest(self.hand * self.head)) / most if most > 0 else 1.0

    def chances(self, tempering: float) -> Values:
        """The probability of each POI, all alike beforehand: the joint likelihood to the power of `tempering`, summing to 1."""
        weights = (self.joint / _largest(self.joint)) ** tempering
        return np.asarray(weights / np.add.reduce(weights))


class SourceCurves:
    """What hand and head tell of each bearing, by these settings: logarithms of likelihoods. Those asked for last are kept.

    Of a walk only the last view changes from frame to frame.
    """

    KEPT = 128

    def __init__(self, hand: HandConfig, head: HeadConfig, confusion: HandConfusion | None = None) -> None:
        """By the paper's table 1 or another."""
        self.hand_config, self.head_config = hand, head
        self._of_gestures = {gesture: gesture_curve(gesture, hand, confusion or table_1()) for gesture in GESTURES}
        self.of_hand: Callable[[HandObservation], Curve] = lru_cache(self.KEPT)(self._log_of_hand)
        self.of_head: Callable[[HeadObservation], Curve] = lru_cache(self.KEPT)(self._log_of_head)

    def _log_of_hand(self, seen: HandObservation) -> Curve:
        return np.log(self._of_gestures[seen.gesture] * bearing_curve(seen, self.hand_config))

    def _log_of_head(self, seen: HeadObservation) -> Curve:
        return np.log(head_curve(seen, self.head_config))


def weigh(evidence: Evidence, seen: Sight, curves: SourceCurves) -> Weighing:
    """Weigh all POIs in sight (one at least). A source that says nothing fits each alike.

    The frames of a stroke err alike: what was seen from several places is one observation, and each counts by its share of it
    (a geometric mean), so that a longer stroke is no surer than a short one.
    """
    views = evidence.views or (View(evidence.hand, evidence.head),)
    names, stacked = _told(evidence, views, curves)
    if not names:
        even = np.ones(len(seen))
        return Weighing(even, even, even, even)
    places = [view.place for view in views if view.place is not None]
    found = np.empty((len(names) + 2, len(seen)))
    for part, count in _parts(seen, places):
        found[:, part] = _part(stacked, seen.cases_from(places, part, count))
    by_name = dict(zip((*names, "joint", "most"), found, strict=True))
    hand, head = (by_name[name] if name in names else np.ones(len(seen)) for name in ("hand", "head"))
    best = math.prod(_largest(stacked, axis=2).ravel().tolist())
    floor = math.prod(np.minimum.reduce(stacked[-1], axis=1).tolist()) if "head" in names else 1.0
    joint, fit = by_name["joint"], by_name["most"] / best
    # How well a POI fits is about directions: a height that is wrong makes no POI one that nobody can have meant.
    hand_high, head_high = _heights(evidence, seen, curves)
    if hand_high is not None:
        hand, joint = hand * hand_high, joint * hand_high
    if head_high is not None:
        head, joint, floor = head * head_high, joint * head_high, floor * float(np.minimum.reduce(head_high))
    return Weighing(hand, head, joint, fit, floor)


def _parts(seen: Sight, places: Sequence[PersonPlace]) -> Iterator[tuple[Indices | slice, int]]:
    """POIs that are weighed together, and in how many cases.

    Of a walk past very many those whose bearing is well known are weighed in few cases: each is weighed from every place.
    """
    if len(seen) <= MANY:
        yield slice(None), CASES
        return
    everybody = np.arange(len(seen))
    groups = [(everybody, CASES)]
    if places:
        well_known = seen.bearings.sigma < FEW_BELOW_DEG
        groups = [(everybody[~well_known], CASES), (everybody[well_known], FEW_CASES)]
    for which, count in groups:
        at_a_time = max(1, AT_A_TIME * CASES // (count * max(1, len(places))))
        for start in range(0, len(which), at_a_time):
            yield which[start : start + at_a_time], count


def _heights(evidence: Evidence, seen: Sight, curves: SourceCurves) -> tuple[Values | None, Values | None]:
    """The likelihoods of how high hand and head go (n each), where that was measured and from one place (`height.py`)."""
    hand, head = evidence.hand, evidence.head
    by_hand = hand is not None and hand.elevation_deg is not None
    by_head = head is not None and head.pitch_deg is not None
    if not (by_hand or by_head) or evidence.views or seen.place is None:
        return None, None
    heights = Heights.of(seen.place, seen.points.xyz[seen.chosen], seen.points.extent[seen.chosen])
    return (
        hand_likelihoods(hand, heights, curves.hand_config) if hand is not None else None,
        head_likelihoods(head, seen.place, heights, curves.head_config) if head is not None else None,
    )


def _part(told: Values, cases: Singles) -> Values:
    """Of a part of the POIs: likelihoods of each source that tells something, of all together, and in the best case (s + 2, n).

    `told` are the sources' curves in v views (s, v, 360).
    """
    of_views = at(told, cases)
    of_sources = np.multiply.reduce(of_views, axis=1) if told.shape[1] > 1 else of_views[:, 0]
    joint = np.multiply.reduce(of_sources, axis=0)
    sums = np.concatenate([np.add.reduce(of_sources, axis=1), np.add.reduce(joint)[None]])
    return np.concatenate([sums / np.float32(len(joint)), _largest(joint)[None]])


def _told(evidence: Evidence, views: Sequence[View], curves: SourceCurves) -> tuple[list[str], Values]:
    """The sources that tell something, hand before head; and what each tells in each view, to the power of its share in all
    (s, v, 360).

    Each is trusted by what it shows over all views.
    """
    names, logs, powers = [], list[Curve](), list[float]()
    hand, head = evidence.hand, evidence.head
    if hand is not None and any(view.hand and view.hand_share for view in views):
        names.append("hand")
        logs += [curves.of_hand(view.hand) if view.hand else NOTHING for view in views]
        powers += [_trust(hand.agreement) * view.hand_share for view in views]
    if head is not None and any(view.head and view.head_share for view in views):
        names.append("head")
        logs += [curves.of_head(view.head) if view.head else NOTHING for view in views]
        powers += [_trust(head.agreement) * view.head_share for view in views]
    if not names:
        return names, np.empty((0, len(views), len(NOTHING)))
    told = np.concatenate(logs).reshape(-1, len(NOTHING))
    told *= np.array(powers)[:, None]
    np.exp(told, out=told)
    return names, told.reshape(len(names), len(views), len(NOTHING))


def _trust(agreement: float) -> float:
    """A source counts for less where the frames of a stroke disagree."""
    return 0.5 + 0.5 * min(1.0, max(0.0, agreement))
