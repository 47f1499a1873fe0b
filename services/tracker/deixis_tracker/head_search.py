"""Looks for heads that nobody follows yet: the whole picture, a scale at a time, and again at places where one may be.

Of frames larger than VGA, parts are looked at in turn with the whole, in which far people are too small; it is still one
look at a time. A single look can be wrong, so the log odds of several looks are added up before a head is believed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from deixis_tracker.background import MotionHistory
from deixis_tracker.camera_motion import Shift
from deixis_tracker.config import TrackerConfig
from deixis_tracker.faces import look
from deixis_tracker.finder import HAND, Finder, Look, apart, close_looks, whole_looks
from deixis_tracker.frame import COARSE, Step, Views, around
from deixis_tracker.persons import Person
from deixis_tracker.skin import skin_share
from deixis_tracker.sway import CLEAR, SLIGHT, Glimpse

SEARCH_S = 0.5  # as many looks as show the whole picture at all scales, once somebody is tracked
SCALE_S = 1 / 30  # one look, before
LEAST_ODDS = 0.8  # of a place that is looked at again
DOUBTFUL = 1.0  # log odds that speak neither for a head nor against it: those of things that pass for one
MOST_FOR, MOST_AGAINST = 1.0, 2.0  # that one look adds: looks in a row are wrong together
LOOK_S, MOST_APART = 1 / 30, 2.0  # a look counts in full so long after the last; looks farther apart up to so much
LOOK_AGAIN_S = 0.1  # once somebody is tracked: vases that look like heads cost a third of the tracker's time
MOST_LOOKS, MOST_CANDIDATES, LOOKS_A_FRAME = 30, 12, 2
MOVED = 0.08  # share of a place that moved, of a head
ABOUT = 6.5  # head widths around somebody known: arms reach so far, and what they pass before seems to move
DISTURBED_S = 0.8  # motion says nothing so long after somebody known was there, or the light was switched
# Near somebody known a sway counts of what looks like a head as most heads do: three quarters of them, and 1 of 18 other places
# that the finder took for heads (`fitting/choose_sway.py`).
SURE_ODDS, SURE_LOOKS = 1.7, 4
FACE_WORTH = (
    1.1  # of a frontal face where the finder surely sees a head: both need one picture. Less sure, it was a printed skull
)
FRESH_LOOKS = 4  # so many are taken in frames that follow each other, also once somebody is tracked
LEAST_SKIN = 0.12  # mean P(skin) in the middle of a head that shows some of its face
NEAR = 0.5  # head widths: so near it is the same head
ON_HAND = 0.6  # head widths of a person: what is so near to the middle of a hand is that hand
WALKING = 9.0  # head widths a second


@dataclass
class Candidate:
    """A place where a head may be, and what the looks at it have added up to (`worth`)."""

    x: float
    y: float
    width: float
    odds: float
    seen_ns: int
    looks: int = 1
    sum_of_odds: float = 0.0  # of all looks after the first
    alive: bool = False  # it moved or swayed, or a face was seen from the front
    disturbed_ns: int = -(10**18)  # when its motion said nothing last
    doubted_ns: int = -(10**18)  # when the light changed last, or somebody's hand was there: also a sway says nothing then
    shows_skin: bool = False  # in some look
    glimpse: Glimpse | None = None  # how the place was seen first

    @property
    def is_sure(self) -> bool:
        """Whether the finder sees it as clearly as it sees most heads."""
        return self.looks > SURE_LOOKS and self.sum_of_odds >= SURE_ODDS * (self.looks - 1)

    def shows_face(self, views: Views) -> bool:
        """Whether its face is seen from the front."""
        return look(views.full, self.x, self.y, self.width) is not None

    def is_near(self, x: float, y: float, widths: float) -> bool:
        """Whether a place is so many head widths away at most."""
        return math.hypot(x - self.x, y - self.y) < widths * self.width


class HeadSearch:
    """The search of one camera's pictures, all of one size."""

    def __init__(self, height: int, width: int, frame_scale: float, config: TrackerConfig, finder: Finder) -> None:
        """For working pictures of `height` and `width`, of whose pixels one is `frame_scale` of the frame's."""
        self._config = config
        self._finder = finder
        self._wholes = whole_looks(height, width)
        self._looks = self._wholes + close_looks(height, width, frame_scale, config.min_head_px)
        self._next = 0
        self._begun = False
        self.candidates: list[Candidate] = []

    def search(self, views: Views, tracked: int, step: Step) -> None:
        """Take the looks that are due; `tracked`: number of heads known. New places become candidates."""
        period_s = SEARCH_S / len(self._wholes) if tracked else SCALE_S
        due = min(step.periods(period_s), len(self._wholes)) if self._begun else len(self._wholes)
        self._begun = True
        for _ in range(due):
            self._take(self._looks[self._next], views, step)
            self._next = (self._next + 1) % len(self._looks)

    def _take(self, look: Look, views: Views, step: Step) -> None:
        largest = self._config.max_head_share * views.full.shape[0]
        for seen in apart(self._finder.over(views.full, look).heads(LEAST_ODDS)):
            new = not any(known.is_near(seen.x, seen.y, NEAR) for known in self.candidates)
            if new and self._config.min_head_px <= seen.width <= largest:
                self.candidates.append(Candidate(seen.x, seen.y, seen.width, worth(seen.odds), step.now_ns))

    def confirmed(self, views: Views, motion: MotionHistory, tracked: int, step: Step) -> list[Candidate]:
        """Look at the candidates again, but those found in this picture; those believed are returned and leave the list."""
        found_now = (candidate for candidate in self.candidates if candidate.seen_ns == step.now_ns)
        for candidate in [candidate for candidate in found_now if candidate.odds >= SURE_ODDS - DOUBTFUL][:LOOKS_A_FRAME]:
            candidate.alive = candidate.shows_face(views)
            candidate.odds += FACE_WORTH * candidate.alive
        earlier = [candidate for candidate in self.candidates if candidate.seen_ns < step.now_ns]
        if tracked and not step.periods(LOOK_AGAIN_S):
            earlier = [candidate for candidate in earlier if candidate.looks < FRESH_LOOKS]
        for candidate in sorted(earlier, key=lambda c: c.looks)[:LOOKS_A_FRAME]:
            self._look(candidate, views, step)
            if not candidate.alive:
                candidate.alive = (
                    self._moves(candidate, motion, step) or candidate.shows_face(views) or _sways(candidate, views, step)
                )
        believed = [c for c in self.candidates if c.alive and c.odds >= self._config.confirm_odds]
        kept = [c for c in self.candidates if c not in believed and c.odds > -MOST_FOR and c.looks < MOST_LOOKS]
        self.candidates = sorted(kept, key=lambda c: -c.odds)[:MOST_CANDIDATES]
        return believed

    def move(self, shift: Shift) -> None:
        """Move the candidates with the room. What seemed to move then may have been the camera."""
        for candidate in self.candidates:
            candidate.x, candidate.y = shift.moved(candidate.x, candidate.y)
            candidate.glimpse = None

    def disturb(self, persons: list[Person], unstable: bool, step: Step) -> None:
        """Note where motion says nothing in this frame: about people who are known, and everywhere while the light changes."""
        for candidate in self.candidates:
            if unstable or any(_is_hand_of(person, candidate, self._config.hand_odds) for person in persons):
                candidate.doubted_ns = step.now_ns
            if unstable or any(person.distance(candidate.x, candidate.y) < ABOUT for person in persons):
                candidate.disturbed_ns = step.now_ns

    @staticmethod
    def _moves(candidate: Candidate, motion: MotionHistory, step: Step) -> bool:
        """Whether something moved there lately by itself: pictures, vases and busts do not."""
        if step.now_ns - candidate.disturbed_ns < DISTURBED_S * 1e9:
            return False
        half = 0.7 * candidate.width
        box = around(candidate.x, candidate.y, half, half, half, half)
        rows, columns = box.scaled(COARSE * 0.5).window(*motion.history.shape)
        part = motion.history[rows, columns]
        return bool(np.count_nonzero(part) >= MOVED * part.size > 0)

    def _look(self, candidate: Candidate, views: Views, step: Step) -> None:
        around = self._finder.around(views.full, candidate.x, candidate.y, candidate.width)
        since_s = (step.now_ns - candidate.seen_ns) / 1e9
        candidate.seen_ns = step.now_ns
        reach = NEAR + WALKING * min(since_s, MOST_APART * LOOK_AGAIN_S)
        heads = [seen for seen in around.heads(DOUBTFUL - MOST_AGAINST) if candidate.is_near(seen.x, seen.y, reach)]
        candidate.looks += 1
        # Looks that follow each other quickly see nearly the same.
        share = min(since_s / LOOK_S, MOST_APART)
        if not heads:
            candidate.odds -= share * MOST_AGAINST
            return
        best = heads[0]
        candidate.sum_of_odds += best.odds
        candidate.odds += share * worth(best.odds)
        candidate.x, candidate.y = best.x, best.y
        candidate.width += 0.5 * (best.width - candidate.width)
        candidate.shows_skin |= skin_share(views.skin, candidate.x, candidate.y, candidate.width) >= LEAST_SKIN


def _is_hand_of(person: Person, candidate: Candidate, least_odds: float) -> bool:
    """Whether a candidate is somebody's hand: fists are of the size and colour of heads far away, and sway."""
    x, y, reach = candidate.x, candidate.y, ON_HAND * person.width
    tracked = any(math.hypot(hand.motion.x - x, hand.motion.y - y) < reach for hand in person.hands)
    return tracked or (person.around is not None and person.around.odds_near(HAND, x, y, reach) >= least_odds)


def _sways(candidate: Candidate, views: Views, step: Step) -> bool:
    """Whether it sways as people do who stand still: clearly, or slightly where it surely is a head and shows skin.

    Near known people, who may pass before it, only of such a one the sway says anything.
    """
    is_person = candidate.is_sure and candidate.shows_skin
    if step.now_ns - (candidate.doubted_ns if is_person else candidate.disturbed_ns) < DISTURBED_S * 1e9:
        candidate.glimpse = None
        return False
    if candidate.glimpse is None:
        candidate.glimpse = Glimpse.of(views.full, candidate.x, candidate.y, candidate.width, step.now_ns)
        return False
    return candidate.glimpse.sways(views.full, step.now_ns, SLIGHT if is_person else CLEAR)


def worth(odds: float) -> float:
    """What one look says for a head, or against it."""
    return max(-MOST_AGAINST, min(odds - DOUBTFUL, MOST_FOR))
