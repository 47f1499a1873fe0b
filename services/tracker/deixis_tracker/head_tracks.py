"""Follows the heads of all persons, finds new ones and lets go of those lost.

A head is followed by its shape (`finder.py`) and, where that is covered, by its colours and outline (`heads.py`). Several times
a second its face is looked for from the front, which corrects its place and width, teaches the colour of its skin, and is
published for those who estimate its pose.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.background import Background, MotionHistory
from deixis_tracker.camera_motion import Shift
from deixis_tracker.config import TrackerConfig
from deixis_tracker.faces import look, measure
from deixis_tracker.finder import Finder, Seen
from deixis_tracker.frame import COARSE, Box, Image, Step, Views, around, repeated, to_frame
from deixis_tracker.head_search import HeadSearch
from deixis_tracker.heads import LEAST_SUPPORT, HeadColours, HeadFinder
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import Person
from deixis_tracker.skin import SkinModel, skin_share

HEAD_ACCELERATION = 25.0  # head widths per second squared
UNSEEN_SPEED_KEPT = 0.8**30  # of a head that is not seen, per second: it is not flown out of the picture
LEAST_COARSE_HEAD_PX = 32  # narrower heads are followed at full resolution
HEAD_PER_BOX = 0.96  # width of the head, of that of the Haar box that `faces.look` finds on it
BOX_BELOW_HEAD = 0.04  # the centre of that box lies so far below the head's, head widths
LOOK_S, STAGGERED_S = 1 / 6, 1 / 30  # persons are looked at in different frames
# Measuring a face takes longer than all else in a frame, and who estimates head poses needs it when a head begins. A face that
# was turned away or covered may still be turning: measured in each frame, it would agree with itself.
MEASURE_S, MEASURE_BACK_S = 0.8, 0.1
AWAY_S, BACK_FOR_S = 0.3, 0.5
NEW_FOR_S, NEW_SIGHTINGS = 0.5, 5  # a new face is measured in each frame
LEARN_COLOURS_S = 1 / 15
SKIN_FROM_EVERY = 3  # sightings of the face
SHAPE_S = 1 / 15  # what is around a head is looked at so often: it costs a third of a frame
SEEN_ODDS = 0.5  # log odds of the finder from which on it sees the head
NEAR, SAME = 0.8, 0.5  # head widths: the finder's head is so near the prediction; of two heads that are one
SHAPE_SIGMA, COLOURS_AGREE = 0.08, 0.35  # head widths
WIDTH_RATE, WIDTH_OFF = 0.1, 0.25  # how fast the finder's width is taken, and by how much it is off where a face told it
LEARN_SKIN_S, LEAST_SKIN = 0.5, 0.12
LEAST_FACE = 0.08  # of a face that is seen, head widths squared
LEVEL, DARKEST_FACE = np.full((1, 3), 1 / 3, np.float32), 0.55  # of a face's own brightness: hair is darker


class HeadTracks:
    """The persons in view, by their heads."""

    def __init__(
        self,
        size: tuple[int, int],
        frame_scale: float,
        config: TrackerConfig,
        finder: Finder,
        person_ids: Iterator[int],
        ids: Iterator[int],
    ) -> None:
        """For working pictures of `size` (height, width); a pixel is `frame_scale` of the frame's. `ids` number the tracks."""
        self.persons: list[Person] = []
        self.left_out = 0  # faces found and not followed in this frame, for there are `max_persons` already
        self._size = size
        self._config = config
        self._person_ids, self._ids = person_ids, ids
        self._shapes = finder
        self._search = HeadSearch(*size, frame_scale, config, finder)
        self._colours = HeadFinder()

    def update(self, views: Views, room: Background, motion: MotionHistory, skin: SkinModel, step: Step) -> None:
        """Follow all heads in the next frame."""
        self.left_out = 0
        for person in self.persons:
            self._follow(person, views, skin, step)
        self._drop_lost(skin, step)
        self._drop_doubles(skin)
        for person in self.persons:
            person.skin_centre = self._centre_of_skin(person, views, skin.brightness(person.person_id))
        self._find_heads(views, room, motion, skin, step)
        self._measure_faces(views, step)

    def move(self, shift: Shift) -> None:
        """Move all that is known with the room, where the camera moved."""
        for person in self.persons:
            person.move(shift)
        self._search.move(shift)

    # --- those known --------------------------------------------------------------------------------------------------

    def _follow(self, person: Person, views: Views, skin: SkinModel, step: Step) -> None:
        person.motion.predict(step.passed_s)
        seen = None
        if step.periods(SHAPE_S, person.person_id * STAGGERED_S):
            person.around = self._shapes.around(views.full, person.x, person.y, person.width)
            person.around_ns = step.now_ns
            seen = self._seen_as_shape(person)
        picture, scale = (views.coarse, COARSE) if person.width >= LEAST_COARSE_HEAD_PX else (views.full, 1.0)
        found = self._colours.find(picture, person.colours, scale * person.x, scale * person.y, scale * person.width, 0.5)
        x, y = found.x / scale, found.y / scale
        covered = self._hand_before(person)
        person.support = found.support
        person.observed = seen is not None or found.support >= LEAST_SUPPORT
        # Colours are trusted as far as the shape agrees: on a wall of their kind they wander off.
        agrees = seen is None or math.hypot(x - seen.x, y - seen.y) < COLOURS_AGREE * person.width
        if found.support >= LEAST_SUPPORT and agrees:
            person.motion.correct(x, y, person.width * (0.5 if covered else 0.06 + 0.1 * max(0.0, 0.5 - found.support)))
        if seen is not None:
            person.seen_ns = step.now_ns
            person.motion.correct(seen.x, seen.y, SHAPE_SIGMA * person.width)
            self._correct_width(person, seen)
        if not person.observed:
            person.motion.damp(step.kept(UNSEEN_SPEED_KEPT))
        if step.periods(LOOK_S, person.person_id * STAGGERED_S):
            self._look_again(person, views, skin, covered, step)
        lessons = step.periods(LEARN_COLOURS_S)
        if lessons and person.observed and not covered:
            place = scale * person.x, scale * person.y, scale * person.width
            person.colours.learn(picture, *place, repeated(0.03, lessons))

        # Whoever never showed the face has skin, too; of others it is learned better from the front.
        faceless = seen is not None and not covered and not person.sightings
        if step.periods(LEARN_SKIN_S) and faceless and skin_share(views.skin, person.x, person.y, person.width) >= LEAST_SKIN:
            _learn_skin(person, views.full, skin)

    def _seen_as_shape(self, person: Person) -> Seen | None:
        """The head as the finder sees it near the prediction, and nearer to no other head."""
        assert person.around is not None
        near = []
        for seen in person.around.heads(SEEN_ODDS):
            away = person.distance(seen.x, seen.y)
            nearest = min(self.persons, key=lambda p: p.distance(seen.x, seen.y))
            if away < NEAR and nearest is person:
                near.append((seen.odds - 4 * away, seen))
        return max(near, key=lambda pair: pair[0])[1] if near else None

    @staticmethod
    def _correct_width(person: Person, seen: Seen) -> None:
        off = seen.width / person.width - 1
        if not person.sightings or abs(off) > WIDTH_OFF:
            person.width *= 1 + WIDTH_RATE * max(-0.5, min(off, 0.5))

    def _look_again(self, person: Person, views: Views, skin: SkinModel, covered: bool, step: Step) -> None:
        """Correct a head by its frontal face, where that is to be seen. `covered`: a hand is before it."""
        seen = _look(person, views)
        if seen is None:
            person.no_face_ns = step.now_ns
            return
        if not covered:
            if person.sightings and step.now_ns - person.face_ns > AWAY_S * 1e9:
                person.back_ns = step.now_ns
            person.face_ns = step.now_ns
        person.sightings += 1
        person.seen_ns = step.now_ns
        person.observed = True
        person.width += max(0.06, 1 / person.sightings) * (HEAD_PER_BOX * seen.w - person.width)
        x, y = seen.centre
        person.motion.correct(x, y - BOX_BELOW_HEAD * person.width, 0.08 * person.width)
        if person.sightings % SKIN_FROM_EVERY == 1:
            _learn_skin(person, views.full, skin)

    def _centre_of_skin(self, person: Person, views: Views, brightness: float | None) -> tuple[float, float] | None:
        """Centroid of the skin on the head: where the face is on a head that is turned.

        Of the same colour as skin, brown hair is darker: in profile it is most of the head. `brightness`: of the face, if seen.
        """
        rows, columns = person.head_box().scaled(COARSE).window(*views.skin.shape)
        skin = cv2.inRange(views.skin[rows, columns], self._config.skin_high, 255)
        if brightness is not None and skin.size:
            level = cv2.transform(views.coarse[rows, columns], LEVEL)
            likely = cv2.inRange(views.skin[rows, columns], (self._config.skin_low + self._config.skin_high) // 2, 255)
            bright = cv2.bitwise_and(likely, cv2.inRange(level, DARKEST_FACE * brightness, 255))
            skin = bright if self._is_face(bright, person) else skin
        if not self._is_face(skin, person):
            return None
        moments = cv2.moments(skin, binaryImage=True)
        x, y = columns.start + moments["m10"] / moments["m00"], rows.start + moments["m01"] / moments["m00"]
        return x / COARSE, y / COARSE

    @staticmethod
    def _is_face(mask: NDArray[Any], person: Person) -> bool:
        return cv2.countNonZero(mask) >= LEAST_FACE * (COARSE * person.width) ** 2 > 0

    def _hand_before(self, person: Person) -> bool:
        w = person.width
        return any(
            abs(hand.motion.x - person.x) < 1.0 * w
            and -0.9 * w < hand.motion.y - person.y < 0.9 * w
            and hand.motion.sigma_px < 2 * w
            for other in self.persons
            for hand in other.hands
        )

    def _drop_lost(self, skin: SkinModel, step: Step) -> None:
        patience_ns = self._config.lose_face_after_s * 1e9
        for person in [p for p in self.persons if step.now_ns - p.seen_ns > patience_ns or self._left_picture(p)]:
            self.persons.remove(person)
            skin.forget_person(person.person_id)

    def _drop_doubles(self, skin: SkinModel) -> None:
        """Of two persons on one head the younger goes."""
        for person in sorted(self.persons, key=lambda p: -p.person_id):
            others = [p for p in self.persons if p.person_id < person.person_id]
            if any(math.hypot(person.x - p.x, person.y - p.y) < 0.5 * SAME * max(person.width, p.width) for p in others):
                self.persons.remove(person)
                skin.forget_person(person.person_id)

    def _left_picture(self, person: Person) -> bool:
        height, width = self._size
        margin = 0.3 * person.width
        return not (-margin < person.x < width + margin and -margin < person.y < height + margin)

    def _measure_faces(self, views: Views, step: Step) -> None:
        """Measure the frontal faces that are due in this frame: one, that its time stays bounded, the least known first."""
        for person in self.persons:
            person.frontal = None
        due = [p for p in self.persons if p.no_face_ns != step.now_ns and _measuring_is_due(p, step)]
        for person in sorted(due, key=lambda p: p.measured):
            seen = _look(person, views)
            if seen is not None:
                in_frame = Box(*to_frame(seen.x, seen.y, views.scale), seen.w * views.scale, seen.h * views.scale)
                person.frontal = measure(views.frame, in_frame, person.measured)
                person.measured += 1
                return

    # --- new ones -----------------------------------------------------------------------------------------------------

    def _find_heads(self, views: Views, room: Background, motion: MotionHistory, skin: SkinModel, step: Step) -> None:
        self._search.search(views, len(self.persons), step)
        self._search.candidates = [c for c in self._search.candidates if not self._is_known(c.x, c.y, c.width)]
        self._search.disturb(self.persons, room.unstable, step)
        for head in self._search.confirmed(views, motion, len(self.persons), step):
            self._add(head.x, head.y, head.width, views, room, skin, step)

    def _add(self, x: float, y: float, width: float, views: Views, room: Background, skin: SkinModel, step: Step) -> None:
        """A new person whose head was found with its centre at (x, y), unless it is not new, or one too many."""
        if self._is_known(x, y, width):
            return
        if len(self.persons) >= self._config.max_persons:
            self.left_out += 1
            return
        motion = PointFilter(x, y, 0.1 * width, HEAD_ACCELERATION * width)
        now_ns = step.now_ns
        person = Person(next(self._person_ids), next(self._ids), motion, width, HeadColours(), now_ns, now_ns)
        person.around = self._shapes.around(views.full, x, y, width)
        person.around_ns = now_ns
        person.colours.learn(views.full, person.x, person.y, width, 1.0)
        self.persons.append(person)
        if _look(person, views) is not None:
            person.sightings, person.face_ns = 1, now_ns
            _learn_skin(person, views.full, skin)
        rows, columns = person.head_box().scaled(COARSE).window(*views.changed.shape)
        if views.changed[rows, columns].mean() < 0.5 * 255:  # was here when the room was learned
            room.mark_unknown(person.resting_hands_box().scaled(COARSE))

    def _is_known(self, x: float, y: float, width: float) -> bool:
        """Whether a head is one that is followed already."""
        return any(math.hypot(x - p.x, y - p.y) < SAME * max(width, p.width) for p in self.persons)


def _measuring_is_due(person: Person, step: Step) -> bool:
    if person.measured < NEW_SIGHTINGS and step.now_ns - person.since_ns < NEW_FOR_S * 1e9:
        return True
    was_away = step.now_ns - person.face_ns > AWAY_S * 1e9 or step.now_ns - person.back_ns < BACK_FOR_S * 1e9
    return step.periods(MEASURE_BACK_S if was_away else MEASURE_S, person.person_id * STAGGERED_S) > 0


def _look(person: Person, views: Views) -> Box | None:
    """The Haar box of a person's face, where it is seen from the front."""
    return look(views.full, person.x, person.y + BOX_BELOW_HEAD * person.width, person.width)


def _learn_skin(person: Person, work: Image, skin: SkinModel) -> None:
    w = person.width
    rows, columns = around(person.x, person.y, 0.27 * w, 0.1 * w, 0.27 * w, 0.42 * w).window(*work.shape[:2])
    skin.adapt_person(person.person_id, work[rows, columns].reshape(-1, 3), 0.2)
    if any(abs(h.motion.x - person.x) < 1.4 * w and h.motion.y - person.y < 3.8 * w for h in person.hands):
        return  # a hand raised before the clothes is none of them
    rows, columns = around(person.x, person.y + 2.3 * w, 0.6 * w, 0.7 * w, 0.6 * w, 0.7 * w).window(*work.shape[:2])
    skin.adapt_clothes(person.person_id, np.asarray(work[rows, columns], np.uint8))
