"""Follows the hands of all persons: which blob belongs to which track, what of it is the hand, which hands are new or lost."""

from __future__ import annotations

import math
from collections.abc import Iterator

import cv2
import numpy as np

from deixis_tracker.classifier import Features, label
from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import HAND, LEFT_HAND, RIGHT_HAND
from deixis_tracker.found_hands import KEPT_ODDS, KEPT_SEEN_S, NO_HAND, REACH
from deixis_tracker.frame import Mask, Step
from deixis_tracker.hands import LEAST_THICKNESS, Hand, cut_hand, hand_about, thickness
from deixis_tracker.hypotheses import Cells, Density, best_tracks, cells_of, propagate, sample_pixels, support
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import MOST_HANDS, HandTrack, Person, is_shown
from deixis_tracker.segmentation import Blob

HAND_ACCELERATION = 60.0  # head widths per second squared
HAND_SPEED = 16.0  # head widths per second; a quick wave reaches 2 to 3 m/s
LEAP, MOST_LEAP = 0.5, 3.0  # head widths between two sightings of one hand, beside that speed, and at most
UNSEEN_SPEED_KEPT = 0.6**30  # of a hand that is not seen, per second
EVIDENCE_KEPT = 0.995**30  # per second
LEAST_SUPPORT = 0.15
ODDS_NEAR = 0.35  # head widths: the finder's middle of a hand is so near the blob's
# A hand is cut out where the finder sees it if its log odds are so far beyond doubtful ones, and then on down to so far below,
# for so long. Chosen among 0.4, 0.8, 0.9, never, and with or without KEPT, by `deixis eval --stage tracker --seeds 1000:1012`.
# Or if they are so much higher than at the end of the blob, which may be an elbow.
SURELY, LIKELIER = 0.4, 1.0
MOST_AREA, HOLES = 1.6, 0.2  # head widths squared, and head widths: of a hand, and holes in its mask that are filled
ELSEWHERE, FAR_ELSEWHERE = 0.3, 2.2  # head widths from the end of the blob
ELSEWHERE_S, ELSEWHERE_GAP_S = 0.1, 0.15  # so long a place is seen before a hand goes there: two looks of the finder
UNLIKELY_S = 0.2  # what the finder takes for no hand for so long is none, whatever its colour; blurred ones it misses a while
EDGE_PX = 2  # a hand so near the picture's edge is cut by it

Claim = tuple[Person, HandTrack]
Odds = tuple[float, float]  # of a right and of a left hand


class HandTracks:
    """Keeps the `hands` of persons."""

    def __init__(self, size: tuple[int, int], config: TrackerConfig, ids: Iterator[int]) -> None:
        """For working pictures of `size` (height, width); `ids` number the tracks."""
        self._size = size
        self._config = config
        self._ids = ids

    def update(self, persons: list[Person], blobs: list[Blob], step: Step) -> None:
        """Follow all hands into the blobs of the next frame."""
        tracks = [(person, hand) for person in persons for hand in person.hands]
        for person, hand in tracks:
            hand.motion.limit(HAND_SPEED * person.width)
            hand.motion.predict(step.passed_s)
            hand.blob = None
        densities = [self._density(person, hand) for person, hand in tracks]
        cells = [cells_of(blob.mask, blob.x0, blob.y0) for blob in blobs]
        supports = np.array([[support(density, c) for c in cells] for density in densities]).reshape(len(tracks), len(blobs))
        unclaimed: list[Blob] = []
        for k, claimants in enumerate(best_tracks(supports, LEAST_SUPPORT)):
            claims = _one_per_arm(claimants, tracks)
            parts = self._split(blobs[k], cells[k], [tracks[t] for t in claims], [densities[t] for t in claims])
            seen = [self._observe(person, hand, part, step) for (person, hand), part in parts]
            if not any(seen):
                unclaimed.append(blobs[k])
        for blob in unclaimed:
            self._find_hand(persons, blob, step)
        for person in persons:
            self._settle(person, step)

    def _density(self, person: Person, hand: HandTrack) -> Density:
        x, y = hand.last_seen
        dx, dy = hand.motion.x - x, hand.motion.y - y
        return propagate(hand.pixels, dx, dy, min(hand.motion.sigma_px, 0.6 * person.width), *self._size)

    def _split(self, blob: Blob, cells: Cells, claims: list[Claim], densities: list[Density]) -> list[tuple[Claim, Blob]]:
        """Give each claiming track its pixels of the blob, by density of the hypotheses."""
        if len(claims) <= 1:
            return [(claim, blob) for claim in claims]
        best = np.argmax([density.at(cells) for density in densities], axis=0)
        rows, columns = np.nonzero(blob.mask)
        parts = []
        for k, claim in enumerate(claims):
            mask = np.zeros_like(blob.mask)
            mask[rows[best == k], columns[best == k]] = 1
            area = int(mask.sum())
            if area >= self._config.min_hand_area * claim[0].width ** 2:
                parts.append((claim, blob._replace(mask=mask, area=area)))
        return parts

    def _cut(
        self,
        person: Person,
        blob: Blob,
        expected: tuple[float, float] | None,
        side_x: float,
        now_ns: int,
        track: HandTrack | None = None,
    ) -> Hand | None:
        shoulders = [person.shoulder(side_x)]
        if expected is None and blob.x0 < person.x < blob.x0 + blob.mask.shape[1]:
            shoulders = [person.shoulder(person.x - 1), person.shoulder(person.x + 1)]  # an arm across the body: of either side
        width, length = person.width, self._config.hand_length
        hands = [cut_hand(blob.mask, blob.x0, blob.y0, shoulder, width, length, expected) for shoulder in shoulders]
        hand = max(hands, key=lambda h: min(math.dist(h.tip, shoulder) for shoulder in shoulders))
        hand, as_seen = self._as_seen(person, blob, hand, track, now_ns)
        if not self._is_whole(person, hand):
            mended = self._mended(person, blob, hand, track, now_ns)
            if mended is None:
                return None
            hand, as_seen = mended, True
        if as_seen and track is not None:
            track.as_seen_ns = now_ns
        return hand

    def _is_whole(self, person: Person, hand: Hand) -> bool:
        least, most = self._config.min_hand_area * person.width**2, MOST_AREA * person.width**2
        return least <= hand.area <= most and thickness(hand.mask) >= LEAST_THICKNESS * person.width

    def _mended(self, person: Person, blob: Blob, like: Hand, track: HandTrack | None, now_ns: int) -> Hand | None:
        """The hand that the finder surely sees on a blob whose end is none: before a wall of the colour of skin a blob is full
        of holes, too thin everywhere, and its end as often at the shoulder.
        """
        if person.around is None:
            return None
        width, places = person.width, person.around.hands(HAND, self._config.hand_odds + SURELY)
        current = [(seen.x, seen.y) for seen in places if not person.is_outdated(seen.x, seen.y, now_ns)]
        if track is not None:
            current.sort(key=lambda at: math.dist(at, (track.motion.x, track.motion.y)))
        for place in current:
            hand = hand_about(_closed(blob.mask, HOLES * width), blob.x0, blob.y0, place, REACH * width, like)
            if hand is not None and math.dist(hand.centroid, place) < ODDS_NEAR * width and self._is_whole(person, hand):
                return hand
        return None

    def _as_seen(self, person: Person, blob: Blob, hand: Hand, track: HandTrack | None, now_ns: int) -> tuple[Hand, bool]:
        """The hand where the finder surely sees it on this blob, if that is elsewhere than the blob's end, for walls pass for
        skin; and whether it was cut so. A track that was is cut so on, also where the finder doubts: a hand that leaps to
        and fro is none that is held still.
        """
        width, kept = person.width, track is not None and now_ns - track.as_seen_ns <= KEPT_SEEN_S * 1e9
        least = self._config.hand_odds + (-KEPT_ODDS if kept else SURELY)
        if not person.is_outdated(*hand.centroid, now_ns):
            least = min(least, max(NO_HAND, _hand_odds(person, hand) + LIKELIER))
        places = _seen_on(person, blob, least)
        if not places:
            return hand, False
        expected = (track.motion.x, track.motion.y) if kept and track is not None else hand.centroid
        place = min(places, key=lambda at: math.dist(at, expected))
        if not (0 if kept else ELSEWHERE) * width <= math.dist(place, hand.centroid) < FAR_ELSEWHERE * width:
            return hand, False
        if track is not None and not kept and not self._stays_elsewhere(person, track, hand, now_ns):
            return hand, False
        cut = hand_about(blob.mask, blob.x0, blob.y0, place, REACH * width, hand)
        return (hand, False) if cut is None else (cut, True)

    def _stays_elsewhere(self, person: Person, track: HandTrack, hand: Hand, now_ns: int) -> bool:
        """Whether a hand that goes on where it just was has been seen elsewhere for a while: one look may be at an elbow."""
        if math.dist(hand.centroid, track.last_seen) >= ODDS_NEAR * person.width:
            return True
        if now_ns - track.elsewhere_ns > ELSEWHERE_GAP_S * 1e9:
            track.elsewhere_since_ns = now_ns
        track.elsewhere_ns = now_ns
        return now_ns - track.elsewhere_since_ns >= ELSEWHERE_S * 1e9

    def _observe(self, person: Person, track: HandTrack, blob: Blob, step: Step) -> bool:
        side = {"left_hand": 1.0, "right_hand": -1.0, "unknown": track.motion.x - person.x}[track.kind]
        # Only a raised forearm can have its hand at the end near the shoulder; and a piece of an arm that grows into the
        # whole arm may have been its elbow.
        raised = track.on_arm and track.motion.y < person.y + 2.4 * person.width
        expected = (track.motion.x, track.motion.y) if raised else None
        hand = self._cut(person, blob, expected, person.x + side, step.now_ns, track)
        if hand is None or math.dist(hand.centroid, track.last_seen) > _reach_px(person, track, step):
            return False
        track.motion.correct(*hand.centroid, 0.06 * person.width)
        odds = _odds(person, hand, self._config.hand_odds)
        self._take_in(person, track, hand, blob, odds, step)
        track.belief.update(_features(person, track, hand, blob, odds), step.passed_s)
        return True

    def _take_in(self, person: Person, track: HandTrack, hand: Hand, blob: Blob, odds: Odds, step: Step) -> None:
        track.pixels = sample_pixels(hand.mask, hand.x0, hand.y0)
        track.blob, track.seen_ns = hand, step.now_ns
        if blob.owner is not None:
            track.as_seen_ns = step.now_ns
        track.on_arm = hand.arm_length_px > 1.2 * self._config.hand_length * person.width
        track.watched_s += step.passed_s
        if self._may_be(person, hand):
            track.likely_ns = step.now_ns
        track.evidence = max(step.kept(EVIDENCE_KEPT) * track.evidence, blob.evidence, _share(max(odds)))

    def _may_be(self, person: Person, hand: Hand) -> bool:
        """Whether the finder does not rule a hand out there. Of one that the picture cuts it may see too little."""
        return person.around is None or _hand_odds(person, hand) >= NO_HAND or self._is_cut(hand)

    def _is_cut(self, hand: Hand) -> bool:
        (height, width), (rows, columns) = self._size, np.nonzero(hand.mask)
        left, top = hand.x0 + columns.min(), hand.y0 + rows.min()
        right, bottom = hand.x0 + columns.max(), hand.y0 + rows.max()
        return bool(min(left, top, width - 1 - right, height - 1 - bottom) <= EDGE_PX)

    def _find_hand(self, persons: list[Person], blob: Blob, step: Step) -> None:
        """Take a blob that no track holds for a lost hand that is seen again, or for a new one."""
        x, y = blob.x0 + blob.mask.shape[1] / 2, blob.y0 + blob.mask.shape[0] / 2
        owners = [person for person in persons if person.person_id == blob.owner]
        person = min(owners or persons, key=lambda p: math.hypot(x - p.x, (y - p.y) * 0.7) / p.width)
        hand = self._cut(person, blob, None, x, step.now_ns)
        if hand is None or person.distance(*hand.centroid) > self._config.reach or not self._may_be(person, hand):
            return
        track, odds = _lost_hand(person, hand, step), _odds(person, hand, self._config.hand_odds)
        if track is not None:  # a blurred hand is lost for some frames, and comes to rest somewhere else
            track.motion.restart(*hand.centroid, 0.1 * person.width)
            self._take_in(person, track, hand, blob, odds, step)
        elif len(person.hands) < MOST_HANDS:
            motion = PointFilter(*hand.centroid, 0.1 * person.width, HAND_ACCELERATION * person.width)
            pixels = sample_pixels(hand.mask, hand.x0, hand.y0)
            track = HandTrack(next(self._ids), motion, pixels, hand, step.now_ns, evidence=blob.evidence)
            track.likely_ns = step.now_ns
            track.belief.update(_features(person, track, hand, blob, odds), 1.0)
            person.hands.append(track)

    def _settle(self, person: Person, step: Step) -> None:
        """Drop the hands lost, label the others."""
        for hand in person.hands:
            if hand.blob is None:
                hand.motion.damp(step.kept(UNSEEN_SPEED_KEPT))
        kept = [hand for hand in person.hands if self._may_be_there(person, hand, step)]
        seen = [hand for hand in kept if hand.blob is not None and _is_likely(hand, step)]
        for hand in kept:
            if hand.blob is not None and not _is_likely(hand, step):
                hand.kind = "unknown"
        for hand, kind in zip(seen, label([h.belief for h in seen], [h.kind for h in seen]), strict=True):
            hand.kind = kind
        shown = {hand.kind for hand in seen if is_shown(hand)}
        person.hands = [hand for hand in kept if hand.blob is not None or hand.kind not in shown]

    def _may_be_there(self, person: Person, hand: HandTrack, step: Step) -> bool:
        x, y, (height, width) = hand.motion.x, hand.motion.y, self._size
        near = person.distance(x, y) < 1.3 * self._config.reach
        recent = step.now_ns - hand.seen_ns <= self._config.lose_hand_after_s * 1e9
        return near and recent and 0 <= x < width and 0 <= y < height


def _closed(mask: Mask, holes_px: float) -> Mask:
    """A mask (0 or 1) without holes and rifts that are narrower."""
    size = max(3, round(holes_px) | 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, kernel), np.uint8)


def _hand_odds(person: Person, hand: Hand) -> float:
    """The finder's log odds of a hand there, of either side; -inf outside of what it has looked at."""
    return person.around.odds_near(HAND, *hand.centroid, ODDS_NEAR * person.width) if person.around is not None else -math.inf


def _is_likely(hand: HandTrack, step: Step) -> bool:
    return step.now_ns - hand.likely_ns <= UNLIKELY_S * 1e9


def _seen_on(person: Person, blob: Blob, least: float) -> list[tuple[float, float]]:
    """Where the finder sees hands on a blob."""
    if person.around is None:
        return []
    height, width = blob.mask.shape
    seen = [(one.x, one.y) for one in person.around.hands(HAND, least)]
    cells = [(round(x - blob.x0), round(y - blob.y0)) for x, y in seen]
    inside = [0 <= column < width and 0 <= row < height and bool(blob.mask[row, column]) for column, row in cells]
    return [place for place, on_blob in zip(seen, inside, strict=True) if on_blob]


def _one_per_arm(claims: list[int], tracks: list[Claim]) -> list[int]:
    """Of tracks on one blob keep one per person and side.

    A bare arm that was seen in pieces has a track on each; when the pieces grow together there is only one hand, at the
    end. Two hands that touch are both known by their sides.
    """
    kept: dict[tuple[int, str], int] = {}
    for t in sorted(claims, key=lambda t: (tracks[t][1].kind == "unknown", -tracks[t][1].watched_s)):
        person, hand = tracks[t]
        known = [kind for owner, kind in kept if owner == person.person_id]
        if hand.kind in known or (hand.kind == "unknown" and known):
            person.hands.remove(hand)
        else:
            kept[person.person_id, hand.kind] = t
    return sorted(kept.values())


def _features(person: Person, track: HandTrack, hand: Hand, blob: Blob, odds: Odds) -> Features:
    w = person.width
    speed = math.hypot(track.motion.vx, track.motion.vy) / w
    dx, dy = (track.motion.x - person.x) / w, (track.motion.y - person.y) / w
    evidence = max(blob.evidence, _share(max(odds)))
    return Features(dx, dy, speed, hand.area / w**2, evidence, blob.sure, *odds)


def _odds(person: Person, hand: Hand, doubtful: float) -> Odds:
    """The finder's log odds of a right and of a left hand there, beyond `doubtful` ones; 0 where it has not looked."""
    if person.around is None:
        return 0.0, 0.0
    right, left = (person.around.odds_near(kind, *hand.centroid, ODDS_NEAR * person.width) for kind in (RIGHT_HAND, LEFT_HAND))
    return (right - doubtful, left - doubtful) if math.isfinite(right) else (0.0, 0.0)


def _share(odds: float) -> float:
    return 1 / (1 + math.exp(-max(-20.0, min(odds, 20.0)))) if odds else 0.0


def _lost_hand(person: Person, hand: Hand, step: Step) -> HandTrack | None:
    """The hand not seen now that may have come to where `hand` was found, the nearest."""
    near = []
    for track in person.hands:
        gap = math.dist(track.last_seen, hand.centroid)
        if track.blob is None and gap < _reach_px(person, track, step):
            near.append((gap, track.track_id, track))
    return min(near)[2] if near else None


def _reach_px(person: Person, track: HandTrack, step: Step) -> float:
    """How far a hand can be from where it was seen last."""
    return person.width * min(MOST_LEAP, LEAP + HAND_SPEED * (step.now_ns - track.seen_ns) / 1e9)
