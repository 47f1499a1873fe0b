"""Follows the heads of all persons, finds new ones and lets go of those lost.

A head is followed by its colours and outline (`heads.py`). Several times a second its face is looked for from the front, which
corrects its place and width, teaches the colour of its skin, and is published for those who estimate its pose.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from deixis_tracker.background import Background
from deixis_tracker.config import TrackerConfig
from deixis_tracker.faces import FaceSearch, look, measure
from deixis_tracker.frame import COARSE, Box, Image, Mask, Step, Views, around, repeated, to_frame
from deixis_tracker.heads import LEAST_SUPPORT, HeadColours, HeadFinder, Walkers, silhouette_heads
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import Person
from deixis_tracker.skin import SkinModel

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
MOST_IN_FRONT = 2.5  # a face on the body of a tracked person is a shirt, unless it is so much larger: somebody in front


class HeadTracks:
    """The persons in view, by their heads."""

    def __init__(self, size: tuple[int, int], config: TrackerConfig, person_ids: Iterator[int], ids: Iterator[int]) -> None:
        """For working pictures of `size` (height, width); `ids` number the tracks."""
        self.persons: list[Person] = []
        self.left_out = 0  # faces found and not followed in this frame, for there are `max_persons` already
        self._size = size
        self._config = config
        self._person_ids, self._ids = person_ids, ids
        self._search = FaceSearch(*size, config)
        self._walkers = Walkers()
        self._finder = HeadFinder()

    def update(self, views: Views, room: Background, people: Mask, skin: SkinModel, step: Step) -> None:
        """Follow all heads in the next frame. `people`: where they were in the last one, coarse."""
        self.left_out = 0
        for person in self.persons:
            self._follow(person, views, skin, step)
        self._drop_lost(skin, step)
        for person in self.persons:
            person.skin_centre = self._centre_of_skin(person, views.skin)
        self._find_faces(views, room, skin, step)
        self._find_walkers(views, room, people, step)
        self._measure_faces(views, step)

    # --- those known --------------------------------------------------------------------------------------------------

    def _follow(self, person: Person, views: Views, skin: SkinModel, step: Step) -> None:
        person.motion.predict(step.passed_s)
        picture, scale = (views.coarse, COARSE) if person.width >= LEAST_COARSE_HEAD_PX else (views.full, 1.0)
        found = self._finder.find(picture, person.colours, scale * person.x, scale * person.y, scale * person.width, 0.5)
        person.support = found.support
        person.observed = found.support >= LEAST_SUPPORT
        covered = self._hand_before(person)
        if person.observed:
            person.seen_ns = step.now_ns
            sigma = person.width * (0.5 if covered else 0.06 + 0.1 * max(0.0, 0.5 - found.support))
            person.motion.correct(found.x / scale, found.y / scale, sigma)
        else:
            person.motion.damp(step.kept(UNSEEN_SPEED_KEPT))
        if step.periods(LOOK_S, person.person_id * STAGGERED_S):
            self._look_again(person, views, skin, covered, step)
        lessons = step.periods(LEARN_COLOURS_S)
        if lessons and person.observed and not covered:
            place = scale * person.x, scale * person.y, scale * person.width
            person.colours.learn(picture, *place, repeated(0.03, lessons))

    def _look_again(self, person: Person, views: Views, skin: SkinModel, covered: bool, step: Step) -> None:
        """Correct a head by its frontal face, where that is to be seen. `covered`: a hand is before it."""
        seen = _look(person, views)
        if seen is None:
            return
        if not covered:
            if step.now_ns - person.face_ns > AWAY_S * 1e9:
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

    def _centre_of_skin(self, person: Person, skin: Image) -> tuple[float, float] | None:
        """Centroid of the skin on the head: where the face is on a head that is turned."""
        rows, columns = person.head_box().scaled(COARSE).window(*skin.shape)
        moments = cv2.moments(cv2.inRange(skin[rows, columns], self._config.skin_high, 255), binaryImage=True)
        if moments["m00"] < 0.08 * (COARSE * person.width) ** 2:
            return None
        x, y = columns.start + moments["m10"] / moments["m00"], rows.start + moments["m01"] / moments["m00"]
        return x / COARSE, y / COARSE

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

    def _left_picture(self, person: Person) -> bool:
        height, width = self._size
        margin = 0.3 * person.width
        return not (-margin < person.x < width + margin and -margin < person.y < height + margin)

    def _measure_faces(self, views: Views, step: Step) -> None:
        """Measure the frontal faces that are due in this frame: one, that its time stays bounded, the least known first."""
        for person in self.persons:
            person.frontal = None
        for person in sorted((p for p in self.persons if _measuring_is_due(p, step)), key=lambda p: p.measured):
            seen = _look(person, views)
            if seen is not None:
                in_frame = Box(*to_frame(seen.x, seen.y, views.scale), seen.w * views.scale, seen.h * views.scale)
                person.frontal = measure(views.frame, in_frame, person.measured)
                person.measured += 1
                return

    # --- new ones -----------------------------------------------------------------------------------------------------

    def _find_faces(self, views: Views, room: Background, skin: SkinModel, step: Step) -> None:
        self._search.search(views, len(self.persons), step)
        self._search.candidates = [c for c in self._search.candidates if not self._is_known(c.x, c.y, HEAD_PER_BOX * c.width)]
        for face in self._search.confirmed(views, step):
            width = HEAD_PER_BOX * face.width
            person = self._add(face.x, face.y - BOX_BELOW_HEAD * width, width, views, room, step)
            if person is not None:
                _learn_skin(person, views.full, skin)

    def _find_walkers(self, views: Views, room: Background, people: Mask, step: Step) -> None:
        heads = [] if room.unstable else silhouette_heads(views.changed, views.skin, people)
        for head in self._walkers.believed(heads, step):
            self._add(head.x, head.y, head.width, views, room, step)

    def _add(self, x: float, y: float, width: float, views: Views, room: Background, step: Step) -> Person | None:
        """A new person whose head was found with its centre at (x, y); None where it is not new, or one too many."""
        if self._is_known(x, y, width):
            return None
        if len(self.persons) >= self._config.max_persons:
            self.left_out += 1
            return None
        motion = PointFilter(x, y, 0.1 * width, HEAD_ACCELERATION * width)
        now_ns = step.now_ns
        person = Person(next(self._person_ids), next(self._ids), motion, width, HeadColours(), now_ns, now_ns, now_ns)
        person.colours.learn(views.full, person.x, person.y, width, 1.0)
        self.persons.append(person)
        rows, columns = person.head_box().scaled(COARSE).window(*views.changed.shape)
        if views.changed[rows, columns].mean() < 0.5 * 255:  # was here when the room was learned
            room.mark_unknown(person.resting_hands_box().scaled(COARSE))
        return person

    def _is_known(self, x: float, y: float, width: float) -> bool:
        """A face cannot be where a tracked head or the body below it is."""
        for p in self.persons:
            dx, dy = abs(x - p.x) / p.width, (y - p.y) / p.width
            if dx < 1.2 and -1.2 < dy < 6 and width < MOST_IN_FRONT * p.width:
                return True
        return False


def _measuring_is_due(person: Person, step: Step) -> bool:
    if person.measured < NEW_SIGHTINGS and step.now_ns - person.since_ns < NEW_FOR_S * 1e9:
        return True
    was_away = step.now_ns - person.face_ns > AWAY_S * 1e9 or step.now_ns - person.back_ns < BACK_FOR_S * 1e9
    return step.periods(MEASURE_BACK_S if was_away else MEASURE_S, person.person_id * STAGGERED_S) > 0


def _look(person: Person, views: Views) -> Box | None:
    """The Haar box of a person's face, where it is seen from the front."""
    return look(views.grey, person.x, person.y + BOX_BELOW_HEAD * person.width, person.width)


def _learn_skin(person: Person, work: Image, skin: SkinModel) -> None:
    w = person.width
    rows, columns = around(person.x, person.y, 0.27 * w, 0.1 * w, 0.27 * w, 0.42 * w).window(*work.shape[:2])
    skin.adapt_person(person.person_id, work[rows, columns].reshape(-1, 3), 0.2)
    if any(abs(h.motion.x - person.x) < 1.4 * w and h.motion.y - person.y < 3.8 * w for h in person.hands):
        return  # a hand raised before the clothes is none of them
    rows, columns = around(person.x, person.y + 2.3 * w, 0.6 * w, 0.7 * w, 0.6 * w, 0.7 * w).window(*work.shape[:2])
    skin.adapt_clothes(person.person_id, np.asarray(work[rows, columns], np.uint8))
