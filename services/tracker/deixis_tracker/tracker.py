"""The tracker: frames in, face and hand tracks out (Pateraki et al. 2011, sec. 4).

One frame passes: background -> skin colour -> faces and heads -> hand blobs -> association by propagated pixel hypotheses ->
hand cut from the arm -> Kalman filter -> classifier.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from deixis_schemas.messages import KindProbabilities, Track
from deixis_schemas.runs import RunClock
from numpy.typing import NDArray

from deixis_tracker.background import Background
from deixis_tracker.boxes import around
from deixis_tracker.classifier import Features, HandBelief, label
from deixis_tracker.coarse import COARSE, coarsened
from deixis_tracker.config import TrackerConfig
from deixis_tracker.faces import FRONTAL, Candidate, FaceDetector, load_cascade
from deixis_tracker.hands import Hand, cut_hand, outline, thickness
from deixis_tracker.heads import LEAST_SUPPORT, HeadColours, HeadFinder
from deixis_tracker.hypotheses import Cells, best_tracks, cells_of, propagate, sample_pixels, support
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import MOST_HANDS, HandTrack, Person
from deixis_tracker.segmentation import Blob, MotionHistory, Views, hand_blobs
from deixis_tracker.silhouettes import SilhouetteHead, find_heads
from deixis_tracker.skin import SkinModel

Image = NDArray[np.uint8]
Mask = NDArray[np.uint8]

LEAST_SIDE_PX = 32
HEAD_ACCELERATION = 25.0  # face widths per second squared
HAND_ACCELERATION = 60.0
HAND_SPEED = 16.0  # face widths per second; a quick wave reaches 2 to 3 m/s
LEAP, MOST_LEAP = 0.5, 3.0  # face widths between two sightings of one hand, beside that speed, and at most
LEAST_SUPPORT_OF_HAND = 0.15
LEAST_THICKNESS = 0.22  # of a hand, face widths; folds of a sleeve and rims of furniture are thinner
HEAD_CENTRE_BELOW_HAAR = -0.04  # the centre of a Haar box lies so far below the head's centre, face widths
WIDTH_OF_HAAR = 0.96
LEAST_COARSE_FACE_PX = 32  # narrower heads are followed at full resolution
LOOK_AGAIN_EVERY = 5  # frames
ADAPT_SKIN_EVERY = 15
ADAPT_ROOM_EVERY = 45
LEAST_EVIDENCE = 0.25
LEAST_FRAMES = 3
WALKER_HITS = 5
MOST_IN_FRONT = 2.6  # a face on the body of a tracked person is a shirt, unless it is so much larger: somebody in front
LONGEST_STEP_S = 0.5
SHOW_LOST_S = 0.2  # a hand is published so long after it was seen last


class Tracker:
    """Core of the tracker stage. One instance per camera; call `update` once a frame, in order."""

    def __init__(self, config: TrackerConfig) -> None:
        self._config = config
        load_cascade(FRONTAL)  # now, not within the first frame
        SkinModel(config.prior_skin)
        self._shape: tuple[int, int] | None = None
        self._ids = 0
        self._person_ids = 0
        self._clock = RunClock()
        self._stamp_ns = 0

    def update(self, image: Image, run: int, stamp_ns: int) -> list[Track]:
        """Track one frame: (H, W, 3) uint8 BGR, of that run of the camera, captured at `stamp_ns`; tracks in its pixels.

        A frame of another run or another size starts anew. Raises ValueError for another type or shape of array.
        """
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise ValueError(f"image: {image.dtype} {image.shape}, but a frame is uint8 (height, width, 3)")
        if min(image.shape[:2]) < LEAST_SIDE_PX:
            raise ValueError(
                f"image: {image.shape[1]} x {image.shape[0]}, but the smallest frame is {LEAST_SIDE_PX} x {LEAST_SIDE_PX}"
            )
        scale = min(1.0, self._config.work_width_px / max(image.shape[:2]))
        size = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
        work = image if scale == 1 else np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
        moment = self._clock.advance(run, stamp_ns)
        if self._shape != image.shape[:2] or moment.new_run:
            self._shape = (image.shape[0], image.shape[1])
            self._reset(work, moment.now_ns)
        self._stamp_ns = moment.now_ns
        self._step(work, moment.now_ns, min(LONGEST_STEP_S, moment.elapsed_s))
        return [track for person in self._persons for track in self._tracks(person, 1 / scale)]

    def _reset(self, work: Image, stamp_ns: int) -> None:
        height, width = self._work_size = work.shape[0], work.shape[1]
        coarse = coarsened(work)
        self._background = Background(coarse, self._config.change_threshold)
        self._motion = MotionHistory(coarse)
        self._skin = SkinModel(self._config.prior_skin)
        self._detector = FaceDetector(height, width, self._config)
        self._finder = HeadFinder()
        self._persons: list[Person] = []
        self._walkers: list[Candidate] = []
        self._frozen: Mask = np.zeros(coarse.shape[:2], np.uint8)
        self._stamp_ns = stamp_ns
        self._frame = 0

    def _step(self, work: Image, now_ns: int, dt_s: float) -> None:
        self._frame += 1
        views = self._view(work)
        self._motion.update(views.coarse)
        for person in self._persons:
            self._follow_head(person, views, now_ns, dt_s)
            person.skin_centre = self._centre_of_skin(person, views.skin)
        self._drop_lost(now_ns)
        self._find_new_faces(views, now_ns)
        if self._persons:
            blobs = hand_blobs(views, self._skin, self._background, self._motion, self._persons, self._config)
            self._follow_hands(blobs, now_ns, dt_s)
        self._frozen = self._people_mask()
        self._background.update(views.coarse, views.changed, self._frozen)
        if self._frame % ADAPT_ROOM_EVERY == 10:
            # Clothes count as room: they hide no skin of the colour that is looked for.
            room = np.where((self._frozen == 0) | (views.skin < self._config.skin_low), 255, 0).astype(np.uint8)
            self._skin.adapt_room(views.coarse, room)

    def _view(self, work: Image) -> Views:
        grey = np.asarray(cv2.cvtColor(work, cv2.COLOR_BGR2GRAY), np.uint8)
        coarse = coarsened(work)
        return Views(work, grey, coarse, self._skin.probability(coarse), self._background.changed(coarse, self._frozen))

    # --- heads --------------------------------------------------------------------------------------------------------

    def _follow_head(self, person: Person, views: Views, now_ns: int, dt_s: float) -> None:
        person.motion.predict(dt_s)
        picture, scale = (views.coarse, COARSE) if person.width >= LEAST_COARSE_FACE_PX else (views.full, 1.0)
        found = self._finder.find(picture, person.colours, scale * person.x, scale * person.y, scale * person.width, 0.5)
        person.support = found.support
        person.observed = found.support >= LEAST_SUPPORT
        covered = self._hand_before(person)
        if person.observed:
            person.seen_ns = now_ns
            sigma = person.width * (0.5 if covered else 0.06 + 0.1 * max(0.0, 0.5 - found.support))
            person.motion.correct(found.x / scale, found.y / scale, sigma)
        else:
            person.motion.damp(0.8)
        if (self._frame + person.person_id) % LOOK_AGAIN_EVERY == 0:
            self._look_again(person, views, now_ns)
        if person.observed and not covered and self._frame % 2 == 0:
            person.colours.learn(picture, scale * person.x, scale * person.y, scale * person.width, 0.03)

    def _look_again(self, person: Person, views: Views, now_ns: int) -> None:
        seen = self._detector.look_again(views.grey, person.x, person.y - HEAD_CENTRE_BELOW_HAAR * person.width, person.width)
        person.frontal = seen is not None
        if seen is None:
            return
        person.frontal_hits += 1
        person.seen_ns = now_ns
        person.observed = True
        person.width += max(0.06, 1 / person.frontal_hits) * (WIDTH_OF_HAAR * seen.w - person.width)
        x, y = seen.centre
        person.motion.correct(x, y + HEAD_CENTRE_BELOW_HAAR * person.width, 0.08 * person.width)
        if person.frontal_hits % (ADAPT_SKIN_EVERY // LOOK_AGAIN_EVERY) == 1:
            self._learn_skin(person, views.full)

    def _learn_skin(self, person: Person, work: Image) -> None:
        w = person.width
        rows, columns = around(person.x, person.y, 0.27 * w, 0.1 * w, 0.27 * w, 0.42 * w).window(*work.shape[:2])
        self._skin.adapt_person(person.person_id, work[rows, columns].reshape(-1, 3), 0.2)
        if self._raised_before_torso(person):
            return
        rows, columns = around(person.x, person.y + 2.3 * w, 0.6 * w, 0.7 * w, 0.6 * w, 0.7 * w).window(*work.shape[:2])
        self._skin.adapt_clothes(person.person_id, work[rows, columns])

    def _raised_before_torso(self, person: Person) -> bool:
        w = person.width
        return any(abs(h.motion.x - person.x) < 1.4 * w and h.motion.y - person.y < 3.8 * w for h in person.hands)

    def _centre_of_skin(self, person: Person, skin: Image) -> tuple[float, float] | None:
        """Centroid of the skin on the head: where the face is on a head that is turned."""
        rows, columns = person.face_box().scaled(COARSE).window(*skin.shape)
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
            for other in self._persons
            for hand in other.hands
        )

    def _drop_lost(self, now_ns: int) -> None:
        gone = [p for p in self._persons if now_ns - p.seen_ns > self._config.lose_face_after_s * 1e9 or self._left_picture(p)]
        for person in gone:
            self._persons.remove(person)
            self._skin.forget_person(person.person_id)

    def _left_picture(self, person: Person) -> bool:
        height, width = self._work_size
        margin = 0.3 * person.width
        return not (-margin < person.x < width + margin and -margin < person.y < height + margin)

    def _find_new_faces(self, views: Views, now_ns: int) -> None:
        self._detector.search(views.grey, views.skin, len(self._persons))
        self._detector.candidates = [c for c in self._detector.candidates if not self._is_known(c)]
        for candidate in self._detector.confirmed(views.grey, views.skin):
            if len(self._persons) < self._config.max_persons and not self._is_known(candidate):
                self._add_person(candidate, views, now_ns)
                self._learn_skin(self._persons[-1], views.full)
        self._find_walkers(views, now_ns)

    def _find_walkers(self, views: Views, now_ns: int) -> None:
        """Believe the head of a silhouette that was seen in some frames in a row, each near the last."""
        heads = [] if self._background.unstable else find_heads(views.changed, views.skin, self._frozen)
        walkers = []
        for small in heads:
            head = SilhouetteHead(*(value / COARSE for value in small))
            before = [w for w in self._walkers if abs(w.x - head.x) < 0.6 * head.width and abs(w.y - head.y) < 0.5 * head.width]
            hits = 1 + max((w.hits for w in before), default=0)
            walkers.append(Candidate(head.x, head.y, head.width / WIDTH_OF_HAAR, hits))
        self._walkers = walkers
        for walker in walkers:
            if walker.hits >= WALKER_HITS and len(self._persons) < self._config.max_persons and not self._is_known(walker):
                walker.y -= HEAD_CENTRE_BELOW_HAAR * walker.width
                self._add_person(walker, views, now_ns)

    def _is_known(self, candidate: Candidate) -> bool:
        """A face cannot be where a tracked head or the body below it is."""
        for p in self._persons:
            dx, dy = abs(candidate.x - p.x) / p.width, (candidate.y - p.y) / p.width
            if dx < 1.2 and -1.2 < dy < 6 and candidate.width < MOST_IN_FRONT * p.width:
                return True
        return False

    def _add_person(self, face: Candidate, views: Views, now_ns: int) -> None:
        width = WIDTH_OF_HAAR * face.width
        motion = PointFilter(face.x, face.y + HEAD_CENTRE_BELOW_HAAR * width, 0.1 * width, HEAD_ACCELERATION * width)
        person = Person(self._person_ids, self._ids, motion, width, HeadColours(), now_ns)
        self._person_ids += 1
        self._ids += 1
        person.colours.learn(views.full, person.x, person.y, width, 1.0)
        self._persons.append(person)
        rows, columns = person.face_box().scaled(COARSE).window(*views.changed.shape)
        if views.changed[rows, columns].mean() < 0.5 * 255:  # was here when the room was learned
            self._background.mark_unknown(person.resting_hands_box().scaled(COARSE))

    # --- hands --------------------------------------------------------------------------------------------------------

    def _follow_hands(self, blobs: list[Blob], now_ns: int, dt_s: float) -> None:
        tracks = [(person, hand) for person in self._persons for hand in person.hands]
        for person, hand in tracks:
            hand.motion.limit(HAND_SPEED * person.width)
            hand.motion.predict(dt_s)
            hand.blob = None
        densities = [self._density(person, hand) for person, hand in tracks]
        cells = [cells_of(blob.mask, blob.x0, blob.y0) for blob in blobs]
        supports = np.array([[support(density, c) for c in cells] for density in densities]).reshape(len(tracks), len(blobs))
        unclaimed: list[Blob] = []
        for k, claimants in enumerate(best_tracks(supports, LEAST_SUPPORT_OF_HAND)):
            claims = self._one_per_arm(claimants, tracks)
            parts = self._split(blobs[k], cells[k], [tracks[t] for t in claims], [densities[t] for t in claims])
            seen = [self._observe(person, hand, part, now_ns, dt_s) for (person, hand), part in parts]
            if not any(seen):
                unclaimed.append(blobs[k])
        for blob in unclaimed:
            self._new_hand(blob, now_ns)
        for person in self._persons:
            self._settle_hands(person, now_ns)

    def _one_per_arm(self, claims: list[int], tracks: list[tuple[Person, HandTrack]]) -> list[int]:
        """Of tracks on one blob keep one per person and side.

        A bare arm that was seen in pieces has a track on each; when the pieces grow together there is only one hand, at the
        end. Two hands that touch are both known by their sides.
        """
        kept: dict[tuple[int, str], int] = {}
        for t in sorted(claims, key=lambda t: (tracks[t][1].kind == "unknown", -tracks[t][1].frames)):
            person, hand = tracks[t]
            known = [kind for owner, kind in kept if owner == person.person_id]
            if hand.kind in known or (hand.kind == "unknown" and known):
                person.hands.remove(hand)
            else:
                kept[person.person_id, hand.kind] = t
        return sorted(kept.values())

    def _density(self, person: Person, hand: HandTrack) -> NDArray[np.float32]:
        dx, dy = hand.motion.x - hand.pixels[:, 0].mean(), hand.motion.y - hand.pixels[:, 1].mean()
        return propagate(hand.pixels, dx, dy, min(hand.motion.sigma_px, 0.6 * person.width), *self._work_size)

    def _split(
        self, blob: Blob, cells: Cells, claims: list[tuple[Person, HandTrack]], densities: list[NDArray[np.float32]]
    ) -> list[tuple[tuple[Person, HandTrack], Blob]]:
        """Give each claiming track its pixels of the blob, by density of the hypotheses."""
        if len(claims) <= 1:
            return [(claim, blob) for claim in claims]
        best = np.argmax([density[cells] for density in densities], axis=0)
        rows, columns = np.nonzero(blob.mask)
        parts = []
        for k, claim in enumerate(claims):
            mask = np.zeros_like(blob.mask)
            mask[rows[best == k], columns[best == k]] = 1
            area = int(mask.sum())
            if area >= self._config.min_hand_area * claim[0].width ** 2:
                parts.append((claim, blob._replace(mask=mask, area=area)))
        return parts

    def _cut(self, person: Person, blob: Blob, expected: tuple[float, float] | None, side_x: float) -> Hand | None:
        shoulders = [person.shoulder(side_x)]
        if expected is None and blob.x0 < person.x < blob.x0 + blob.mask.shape[1]:
            shoulders = [person.shoulder(person.x - 1), person.shoulder(person.x + 1)]  # an arm across the body: of either side
        width, length = person.width, self._config.hand_length
        hands = [cut_hand(blob.mask, blob.x0, blob.y0, shoulder, width, length, expected) for shoulder in shoulders]
        hand = max(hands, key=lambda h: min(math.dist(h.tip, shoulder) for shoulder in shoulders))
        least, most = self._config.min_hand_area * person.width**2, 1.6 * person.width**2
        if not least <= hand.area <= most or thickness(hand.mask) < LEAST_THICKNESS * person.width:
            return None
        return hand

    def _observe(self, person: Person, track: HandTrack, blob: Blob, now_ns: int, dt_s: float) -> bool:
        side = {"left_hand": 1.0, "right_hand": -1.0, "unknown": track.motion.x - person.x}[track.kind]
        # Only a raised forearm can have its hand at the end near the shoulder; and a piece of an arm that grows into the
        # whole arm may have been its elbow.
        raised = track.on_arm and track.motion.y < person.y + 2.4 * person.width
        hand = self._cut(person, blob, (track.motion.x, track.motion.y) if raised else None, person.x + side)
        if hand is None or math.dist(hand.centroid, track.last_seen) > person.width * self._reach_since(track, now_ns):
            return False
        track.motion.correct(*hand.centroid, 0.06 * person.width)
        self._take_in(person, track, hand, blob, now_ns, dt_s)
        return True

    def _take_in(self, person: Person, track: HandTrack, hand: Hand, blob: Blob, now_ns: int, dt_s: float) -> None:
        track.pixels = sample_pixels(hand.mask, hand.x0, hand.y0)
        track.blob, track.seen_ns = hand, now_ns
        track.on_arm = hand.arm_length_px > 1.2 * self._config.hand_length * person.width
        track.frames += 1
        track.evidence = max(0.995 * track.evidence, blob.evidence)
        track.belief.update(self._features(person, track, blob), dt_s)

    def _features(self, person: Person, track: HandTrack, blob: Blob) -> Features:
        w = person.width
        speed = float(np.hypot(track.motion.vx, track.motion.vy)) / w
        area = (track.blob.area if track.blob else 0) / w**2
        dx, dy = (track.motion.x - person.x) / w, (track.motion.y - person.y) / w
        return Features(dx, dy, speed, area, blob.evidence, blob.sure)

    def _new_hand(self, blob: Blob, now_ns: int) -> None:
        x, y = blob.x0 + blob.mask.shape[1] / 2, blob.y0 + blob.mask.shape[0] / 2
        person = min(self._persons, key=lambda p: float(np.hypot(x - p.x, (y - p.y) * 0.7)) / p.width)
        hand = self._cut(person, blob, None, x)
        if hand is None or math.dist(hand.centroid, (person.x, person.y)) > self._config.reach * person.width:
            return
        track = self._lost_hand(person, hand, now_ns)
        if track is not None:  # a blurred hand is lost for some frames, and comes to rest somewhere else
            track.motion.restart(*hand.centroid, 0.1 * person.width)
            self._take_in(person, track, hand, blob, now_ns, 0.0)
            return
        if len(person.hands) >= MOST_HANDS:
            return
        motion = PointFilter(*hand.centroid, 0.1 * person.width, HAND_ACCELERATION * person.width)
        track = HandTrack(self._ids, motion, sample_pixels(hand.mask, hand.x0, hand.y0), hand, now_ns, belief=HandBelief())
        self._ids += 1
        track.evidence = blob.evidence
        track.belief.update(self._features(person, track, blob), 1.0)
        person.hands.append(track)

    def _lost_hand(self, person: Person, hand: Hand, now_ns: int) -> HandTrack | None:
        """The hand not seen now that may have come to where `hand` was found, the nearest."""
        near = []
        for track in person.hands:
            gap = math.dist(track.last_seen, hand.centroid)
            if track.blob is None and gap < person.width * self._reach_since(track, now_ns):
                near.append((gap, track.track_id, track))
        return min(near)[2] if near else None

    @staticmethod
    def _reach_since(track: HandTrack, now_ns: int) -> float:
        """How far a hand can be from where it was seen last, face widths."""
        return min(MOST_LEAP, LEAP + HAND_SPEED * (now_ns - track.seen_ns) / 1e9)

    def _settle_hands(self, person: Person, now_ns: int) -> None:
        """Drop the hands lost, label the others."""
        w, height, width = person.width, *self._work_size
        kept = []
        for hand in person.hands:
            if hand.blob is None:
                hand.motion.damp(0.6)
            near = np.hypot(hand.motion.x - person.x, hand.motion.y - person.y) < 1.3 * self._config.reach * w
            inside = 0 <= hand.motion.x < width and 0 <= hand.motion.y < height
            if near and inside and now_ns - hand.seen_ns <= self._config.lose_hand_after_s * 1e9:
                kept.append(hand)
        seen = [hand for hand in kept if hand.blob is not None]
        for hand, kind in zip(seen, label([h.belief for h in seen], [h.kind for h in seen]), strict=True):
            hand.kind = kind
        shown = {hand.kind for hand in seen if _is_shown(hand)}
        person.hands = [hand for hand in kept if hand.blob is not None or hand.kind not in shown]

    def _people_mask(self) -> Mask:
        mask = np.zeros_like(self._frozen)
        for person in self._persons:
            rows, columns = person.body_box().scaled(COARSE).window(*mask.shape)
            mask[rows, columns] = 255
            margin = 0.8 * person.width
            for hand in person.hands:
                near = around(hand.motion.x, hand.motion.y, margin, margin, margin, margin).scaled(COARSE)
                rows, columns = near.window(*mask.shape)
                mask[rows, columns] = 255
        return mask

    # --- output -------------------------------------------------------------------------------------------------------

    def _tracks(self, person: Person, scale: float) -> list[Track]:
        shown = [hand for hand in person.hands if _is_shown(hand) and self._stamp_ns - hand.seen_ns <= SHOW_LOST_S * 1e9]
        hands = [self._hand_track(person, hand, scale) for hand in shown]
        return [self._face_track(person, scale), *hands]

    def _face_track(self, person: Person, scale: float) -> Track:
        box = person.face_box()
        trust = min(1.0, max(0.05, 0.5 + person.support)) if person.observed else 0.3
        return Track(
            track_id=person.track_id,
            person_id=person.person_id,
            kind="face",
            kind_probabilities=KindProbabilities(face=trust, unknown=1 - trust),
            centroid_px=_to_frame(*(person.skin_centre or box.centre), scale),
            bbox_px=(*_to_frame(box.x, box.y, scale), box.w * scale, box.h * scale),
            velocity_px_s=(person.motion.vx * scale, person.motion.vy * scale),
            observed=person.observed,
            confidence=trust,
        )

    def _hand_track(self, person: Person, hand: HandTrack, scale: float) -> Track:
        probabilities = hand.belief.probabilities()
        contour = outline(hand.blob) if hand.blob else np.empty((0, 2), np.int32)
        x, y, w, h = cv2.boundingRect(contour) if len(contour) else _last_box(hand)
        centre = hand.blob.centroid if hand.blob else (hand.motion.x, hand.motion.y)
        in_frame = np.rint((contour + 0.5) * scale - 0.5) if scale != 1 else contour
        return Track(
            track_id=hand.track_id,
            person_id=person.person_id,
            kind=hand.kind,
            kind_probabilities=probabilities,
            centroid_px=_to_frame(*centre, scale),
            bbox_px=(*_to_frame(x, y, scale), w * scale, h * scale),
            velocity_px_s=(hand.motion.vx * scale, hand.motion.vy * scale),
            contour=in_frame.astype("<i2").tobytes(),
            observed=hand.blob is not None,
            confidence=float(getattr(probabilities, hand.kind)),
        )


def _is_shown(hand: HandTrack) -> bool:
    return hand.kind != "unknown" and hand.evidence >= LEAST_EVIDENCE and hand.frames >= LEAST_FRAMES


def _to_frame(x: float, y: float, scale: float) -> tuple[float, float]:
    """A point of the working picture in the frame; pixel centres are at integers."""
    return (x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5


def _last_box(hand: HandTrack) -> tuple[float, float, float, float]:
    """The box of the last blob seen, where the hand is predicted now."""
    low, high = hand.pixels.min(axis=0), hand.pixels.max(axis=0)
    w, h = (float(v) for v in high - low)
    return hand.motion.x - w / 2, hand.motion.y - h / 2, w, h
