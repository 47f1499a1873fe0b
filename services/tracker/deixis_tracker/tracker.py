"""The tracker: frames in, face and hand tracks out (Pateraki et al. 2011, sec. 4).

One frame passes: background -> skin colour -> faces and heads -> hand blobs -> association by propagated pixel hypotheses ->
hand cut from the arm -> Kalman filter -> classifier.
"""

from __future__ import annotations

import cv2
import numpy as np
from deixis_schemas.messages import KindProbabilities, Track
from numpy.typing import NDArray

from deixis_tracker.background import Background
from deixis_tracker.boxes import around
from deixis_tracker.classifier import Features, HandBelief, label
from deixis_tracker.config import TrackerConfig
from deixis_tracker.faces import Candidate, FaceDetector
from deixis_tracker.hands import Hand, cut_hand, outline
from deixis_tracker.heads import LEAST_SUPPORT, HeadColours, HeadFinder
from deixis_tracker.hypotheses import at_pixels, propagate, sample_pixels, support
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import MOST_HANDS, HandTrack, Person
from deixis_tracker.segmentation import Blob, MotionHistory, hand_blobs
from deixis_tracker.silhouettes import find_heads
from deixis_tracker.skin import SkinModel

Image = NDArray[np.uint8]
Mask = NDArray[np.uint8]

LEAST_SIDE_PX = 32
HEAD_ACCELERATION = 25.0  # face widths per second squared
HAND_ACCELERATION = 60.0
HEAD_CENTRE_BELOW_HAAR = -0.04  # the centre of a Haar box lies so far below the head's centre, face widths
WIDTH_OF_HAAR = 0.96
LOOK_AGAIN_EVERY = 5  # frames
ADAPT_SKIN_EVERY = 15
ADAPT_ROOM_EVERY = 45
LEAST_EVIDENCE = 0.25
LEAST_FRAMES = 3
WALKER_HITS = 5
LONGEST_STEP_S = 0.5


class Tracker:
    """Core of the tracker stage. One instance per camera; call `update` once a frame, in order."""

    def __init__(self, config: TrackerConfig) -> None:
        self._config = config
        self._shape: tuple[int, int] | None = None
        self._ids = 0
        self._person_ids = 0
        self._stamp_ns = 0

    def update(self, image: Image, stamp_ns: int) -> list[Track]:
        """Track one frame: (H, W, 3) uint8 BGR, captured at `stamp_ns`; the tracks are in its pixels.

        A frame of another size, or from before the last one, starts anew. Raises ValueError for another type or shape of array.
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
        if self._shape != image.shape[:2] or stamp_ns < self._stamp_ns:
            self._shape = (image.shape[0], image.shape[1])
            self._reset(work, stamp_ns)
        dt_s = min(LONGEST_STEP_S, (stamp_ns - self._stamp_ns) / 1e9)
        self._stamp_ns = stamp_ns
        self._step(work, stamp_ns, dt_s)
        return [track for person in self._persons for track in self._tracks(person, 1 / scale)]

    def _reset(self, work: Image, stamp_ns: int) -> None:
        height, width = work.shape[:2]
        self._background = Background(work, self._config.change_threshold)
        self._motion = MotionHistory(work)
        self._skin = SkinModel(self._config.prior_skin)
        self._detector = FaceDetector(height, width, self._config)
        self._finder = HeadFinder()
        self._persons: list[Person] = []
        self._walkers: list[Candidate] = []
        self._frozen: Mask = np.zeros((height, width), np.uint8)
        self._stamp_ns = stamp_ns
        self._frame = 0

    def _step(self, work: Image, now_ns: int, dt_s: float) -> None:
        self._frame += 1
        grey = np.asarray(cv2.cvtColor(work, cv2.COLOR_BGR2GRAY), np.uint8)
        skin = self._skin.probability(work)
        changed = self._background.changed(work, self._frozen)
        self._motion.update(work)
        for person in self._persons:
            self._follow_head(person, work, grey, now_ns, dt_s)
            person.skin_centre = self._centre_of_skin(person, skin)
        self._drop_lost(now_ns)
        self._find_new_faces(work, grey, skin, changed, now_ns)
        if self._persons:
            blobs = hand_blobs(work, skin, changed, self._background, self._motion, self._persons, self._config)
            self._follow_hands(blobs, now_ns, dt_s)
        self._frozen = self._people_mask(work.shape[0], work.shape[1])
        self._background.update(work, changed, self._frozen)
        if self._frame % ADAPT_ROOM_EVERY == 10:
            # Clothes count as room: they hide no skin of the colour that is looked for.
            room = np.where((self._frozen == 0) | (skin < self._config.skin_low), 255, 0).astype(np.uint8)
            self._skin.adapt_room(work, room)

    # --- heads --------------------------------------------------------------------------------------------------------

    def _follow_head(self, person: Person, work: Image, grey: Image, now_ns: int, dt_s: float) -> None:
        person.motion.predict(dt_s)
        found = self._finder.find(work, person.colours, person.x, person.y, person.width, 0.5)
        person.support = found.support
        person.observed = found.support >= LEAST_SUPPORT
        covered = self._hand_before(person)
        if person.observed:
            person.seen_ns = now_ns
            sigma = person.width * (0.5 if covered else 0.06 + 0.1 * max(0.0, 0.5 - found.support))
            person.motion.correct(found.x, found.y, sigma)
        else:
            person.motion.damp(0.8)
        if (self._frame + person.person_id) % LOOK_AGAIN_EVERY == 0:
            self._look_again(person, work, grey, now_ns)
        if person.observed and not covered and self._frame % 2 == 0:
            person.colours.learn(work, person.x, person.y, person.width, 0.03)

    def _look_again(self, person: Person, work: Image, grey: Image, now_ns: int) -> None:
        seen = self._detector.look_again(grey, person.x, person.y - HEAD_CENTRE_BELOW_HAAR * person.width, person.width)
        person.frontal = seen is not None
        if seen is None:
            return
        person.frontal_hits += 1
        person.frontal_ns = person.seen_ns = now_ns
        person.observed = True
        person.width += max(0.06, 1 / person.frontal_hits) * (WIDTH_OF_HAAR * seen.w - person.width)
        x, y = seen.centre
        person.motion.correct(x, y + HEAD_CENTRE_BELOW_HAAR * person.width, 0.08 * person.width)
        if person.frontal_hits % (ADAPT_SKIN_EVERY // LOOK_AGAIN_EVERY) == 1:
            self._learn_skin(person, work)

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
        rows, columns = person.face_box().window(*skin.shape)
        moments = cv2.moments(cv2.inRange(skin[rows, columns], self._config.skin_high, 255), binaryImage=True)
        if moments["m00"] < 0.08 * person.width**2:
            return None
        return columns.start + moments["m10"] / moments["m00"], rows.start + moments["m01"] / moments["m00"]

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
        height, width = self._frozen.shape
        margin = 0.3 * person.width
        return not (-margin < person.x < width + margin and -margin < person.y < height + margin)

    def _find_new_faces(self, work: Image, grey: Image, skin: Image, changed: Mask, now_ns: int) -> None:
        self._detector.search(grey, skin, len(self._persons))
        self._detector.candidates = [c for c in self._detector.candidates if not self._is_known(c)]
        for candidate in self._detector.confirmed(grey, skin):
            if len(self._persons) < self._config.max_persons and not self._is_known(candidate):
                self._add_person(candidate, work, changed, now_ns)
                self._learn_skin(self._persons[-1], work)
        self._find_walkers(work, skin, changed, now_ns)

    def _find_walkers(self, work: Image, skin: Image, changed: Mask, now_ns: int) -> None:
        """Believe the head of a silhouette that was seen in some frames in a row, each near the last."""
        heads = [] if self._background.unstable else find_heads(changed, skin, self._frozen)
        walkers = []
        for head in heads:
            before = [w for w in self._walkers if abs(w.x - head.x) < 0.6 * head.width and abs(w.y - head.y) < 0.5 * head.width]
            hits = 1 + max((w.hits for w in before), default=0)
            walkers.append(Candidate(head.x, head.y, head.width / WIDTH_OF_HAAR, hits))
        self._walkers = walkers
        for walker in walkers:
            if walker.hits >= WALKER_HITS and len(self._persons) < self._config.max_persons and not self._is_known(walker):
                walker.y -= HEAD_CENTRE_BELOW_HAAR * walker.width
                self._add_person(walker, work, changed, now_ns)

    def _is_known(self, candidate: Candidate) -> bool:
        """A face cannot be where a tracked head or the body below it is."""
        for p in self._persons:
            dx, dy = abs(candidate.x - p.x) / p.width, (candidate.y - p.y) / p.width
            if dx < 1.2 and -1.2 < dy < 6 and candidate.width < 1.8 * p.width:
                return True
        return False

    def _add_person(self, face: Candidate, work: Image, changed: Mask, now_ns: int) -> None:
        width = WIDTH_OF_HAAR * face.width
        motion = PointFilter(face.x, face.y + HEAD_CENTRE_BELOW_HAAR * width, 0.1 * width, HEAD_ACCELERATION * width)
        person = Person(self._person_ids, self._ids, motion, width, HeadColours(), now_ns, now_ns)
        self._person_ids += 1
        self._ids += 1
        person.colours.learn(work, person.x, person.y, width, 1.0)
        self._persons.append(person)
        rows, columns = person.face_box().window(*changed.shape)
        if changed[rows, columns].mean() < 0.5 * 255:  # was here when the room was learned
            self._background.mark_unknown(person.resting_hands_box())

    # --- hands --------------------------------------------------------------------------------------------------------

    def _follow_hands(self, blobs: list[Blob], now_ns: int, dt_s: float) -> None:
        tracks = [(person, hand) for person in self._persons for hand in person.hands]
        for _, hand in tracks:
            hand.motion.predict(dt_s)
            hand.blob = None
        height, width = self._frozen.shape
        densities = [
            propagate(
                h.pixels,
                h.motion.x - h.pixels[:, 0].mean(),
                h.motion.y - h.pixels[:, 1].mean(),
                h.motion.sigma_px,
                height,
                width,
            )
            for _, h in tracks
        ]
        taken: set[int] = set()
        unclaimed: list[Blob] = []
        for blob in blobs:
            claims = [
                k for k in range(len(tracks)) if k not in taken and support(densities[k], blob.mask, blob.x0, blob.y0) > 0.15
            ]
            parts = self._split(blob, [tracks[k] for k in claims], [densities[k] for k in claims])
            for (person, hand), part in parts:
                if self._observe(person, hand, part, now_ns, dt_s):
                    taken |= {k for k in claims if tracks[k][1] is hand}
            if not claims:
                unclaimed.append(blob)
        for blob in unclaimed:
            self._new_hand(blob, now_ns)
        for person in self._persons:
            self._settle_hands(person, now_ns)

    def _split(
        self, blob: Blob, claims: list[tuple[Person, HandTrack]], densities: list[NDArray[np.float32]]
    ) -> list[tuple[tuple[Person, HandTrack], Blob]]:
        """Give each claiming track its pixels of the blob, by density of the hypotheses."""
        if len(claims) <= 1:
            return [(claim, blob) for claim in claims]
        best = np.argmax([at_pixels(d, blob.mask, blob.x0, blob.y0) for d in densities], axis=0)
        rows, columns = np.nonzero(blob.mask)
        parts = []
        for k, claim in enumerate(claims):
            mask = np.zeros_like(blob.mask)
            mask[rows[best == k], columns[best == k]] = 1
            area = int(mask.sum())
            if area >= self._config.min_hand_area * claim[0].width ** 2:
                parts.append((claim, Blob(mask, blob.x0, blob.y0, area, blob.evidence)))
        return parts

    def _cut(self, person: Person, blob: Blob, expected: tuple[float, float] | None, side_x: float) -> Hand | None:
        hand = cut_hand(blob.mask, blob.x0, blob.y0, person.shoulder(side_x), person.width, self._config.hand_length, expected)
        least, most = self._config.min_hand_area * person.width**2, 1.6 * person.width**2
        return hand if least <= hand.area <= most else None

    def _observe(self, person: Person, track: HandTrack, blob: Blob, now_ns: int, dt_s: float) -> bool:
        side = {"left_hand": 1.0, "right_hand": -1.0, "unknown": track.motion.x - person.x}[track.kind]
        # Only a raised forearm can have its hand at the end near the shoulder.
        raised = track.motion.y < person.y + 2.4 * person.width
        hand = self._cut(person, blob, (track.motion.x, track.motion.y) if raised else None, person.x + side)
        if hand is None:
            return False
        track.motion.correct(*hand.centroid, 0.06 * person.width)
        track.pixels = sample_pixels(hand.mask, hand.x0, hand.y0)
        track.blob, track.seen_ns = hand, now_ns
        track.frames += 1
        track.evidence = max(0.995 * track.evidence, blob.evidence)
        track.belief.update(self._features(person, track, blob.evidence), dt_s)
        return True

    def _features(self, person: Person, track: HandTrack, evidence: float) -> Features:
        w = person.width
        speed = float(np.hypot(track.motion.vx, track.motion.vy)) / w
        area = (track.blob.area if track.blob else 0) / w**2
        return Features((track.motion.x - person.x) / w, (track.motion.y - person.y) / w, speed, area, evidence)

    def _new_hand(self, blob: Blob, now_ns: int) -> None:
        x, y = blob.x0 + blob.mask.shape[1] / 2, blob.y0 + blob.mask.shape[0] / 2
        person = min(self._persons, key=lambda p: float(np.hypot(x - p.x, (y - p.y) * 0.7)) / p.width)
        if len(person.hands) >= MOST_HANDS:
            return
        hand = self._cut(person, blob, None, x)
        if (
            hand is None
            or np.hypot(hand.centroid[0] - person.x, hand.centroid[1] - person.y) > self._config.reach * person.width
        ):
            return
        motion = PointFilter(*hand.centroid, 0.1 * person.width, HAND_ACCELERATION * person.width)
        track = HandTrack(self._ids, motion, sample_pixels(hand.mask, hand.x0, hand.y0), hand, now_ns, belief=HandBelief())
        self._ids += 1
        track.evidence = blob.evidence
        for lost in person.hands:  # a hand that jumped, e.g. blurred, is likelier the one just lost than the one in view
            if lost.blob is None and lost.kind != "unknown":
                track.belief.favour(lost.kind)
        track.belief.update(self._features(person, track, blob.evidence), 1.0)
        person.hands.append(track)

    def _settle_hands(self, person: Person, now_ns: int) -> None:
        """Drop the hands lost, label the others."""
        w, height, width = person.width, *self._frozen.shape
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

    def _people_mask(self, height: int, width: int) -> Mask:
        mask = np.zeros((height, width), np.uint8)
        for person in self._persons:
            rows, columns = person.body_box().window(height, width)
            mask[rows, columns] = 255
            margin = 0.8 * person.width
            for hand in person.hands:
                rows, columns = around(hand.motion.x, hand.motion.y, margin, margin, margin, margin).window(height, width)
                mask[rows, columns] = 255
        return mask

    # --- output -------------------------------------------------------------------------------------------------------

    def _tracks(self, person: Person, scale: float) -> list[Track]:
        hands = [self._hand_track(person, hand, scale) for hand in person.hands if _is_shown(hand)]
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
