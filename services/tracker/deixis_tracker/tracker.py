"""The tracker: frames in, face and hand tracks out (Pateraki et al. 2011, sec. 4).

One frame passes: motion of the camera -> background -> skin colour -> heads and faces -> hand blobs -> association by
propagated pixel hypotheses -> hand cut from the arm -> Kalman filter -> classifier.
"""

from __future__ import annotations

from itertools import count

import cv2
import numpy as np
from deixis_schemas.messages import Track
from deixis_schemas.runs import RunClock

from deixis_tracker.background import Background, MotionHistory
from deixis_tracker.camera_motion import CameraMotion
from deixis_tracker.config import TrackerConfig
from deixis_tracker.faces import load_cascade
from deixis_tracker.finder import Finder
from deixis_tracker.fingers import with_fingers
from deixis_tracker.found_hands import found_hands
from deixis_tracker.frame import Image, Mask, Step, Views, coarsened
from deixis_tracker.hand_tracks import HandTracks
from deixis_tracker.head_tracks import HeadTracks
from deixis_tracker.persons import Person, people_mask, tracks_of
from deixis_tracker.segmentation import hand_blobs, head_zone
from deixis_tracker.skin import SkinModel, is_grey

LEAST_SIDE_PX = 32
LONGEST_STEP_NS = 500_000_000
FIRST_NS = 33_333_333  # the first frame of a run ends so late in it
GREY_CHECKED_S = 0.5
LEARN_ROOM_S, LEARN_ROOM_AHEAD_S = 1.5, 35 / 30  # the first time after a third of a second


class FrameRefused(ValueError):
    """An array that is no frame."""


class Tracker:
    """Core of the tracker stage. One instance per camera; call `update` once a frame, in order."""

    def __init__(self, config: TrackerConfig) -> None:
        load_cascade()  # now, not within the first frame
        SkinModel(config.prior_skin)
        self._config = config
        self._finder = Finder()
        self._clock = RunClock()
        self._began_ns = 0
        self._shape: tuple[int, int] = (0, 0)
        self.camera_moves = False  # the camera itself moved just now
        self.is_grey = False  # the picture has no colour, which says then nothing of skin
        self.skin: Image = np.zeros((1, 1), np.uint8)  # P(skin) of the last frame, 255 is certain; small: see `frame.COARSE`
        self.room_offset_px = (0.0, 0.0)  # how far the room has moved in the middle of the picture since the run began
        self._person_ids, self._track_ids = count(), count()

    @property
    def left_out(self) -> int:
        """Persons seen anew in the last frame and not followed, for there are `max_persons` already."""
        return self._heads.left_out

    def update(self, image: Image, run: int, stamp_ns: int) -> list[Track]:
        """Track one frame: (H, W, 3) uint8 BGR, of that run of the camera, captured at `stamp_ns`; tracks in its pixels.

        A frame of another run or another size starts anew. Raises FrameRefused for another type or shape of array.
        """
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise FrameRefused(f"image: {image.dtype} {image.shape}, but a frame is uint8 (height, width, 3)")
        height, width = image.shape[:2]
        if min(height, width) < LEAST_SIDE_PX:
            raise FrameRefused(f"image: {width} x {height}, but the smallest frame is {LEAST_SIDE_PX} x {LEAST_SIDE_PX}")
        scale = min(1.0, self._config.work_width_px / max(height, width))
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        work = image if scale == 1 else np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
        moment = self._clock.advance(run, stamp_ns)
        if moment.new_run or self._shape != (height, width):
            self._shape = height, width
            self._began_ns = moment.now_ns - FIRST_NS
            self._reset(work, 1 / scale)
        run_ns = moment.now_ns - self._began_ns
        passed_ns = min(LONGEST_STEP_NS, round(moment.elapsed_s * 1e9) or run_ns)
        self._step(image, work, 1 / scale, Step(moment.now_ns, run_ns, passed_ns))
        self.room_offset_px = self._camera.offset[0] / scale, self._camera.offset[1] / scale
        return [track for person in self._heads.persons for track in tracks_of(person, moment.now_ns, 1 / scale)]

    def _reset(self, work: Image, scale: float) -> None:
        size = work.shape[0], work.shape[1]
        coarse = coarsened(work)
        self.is_grey = is_grey(coarse)
        self._camera = CameraMotion(coarse)
        self._room = Background(coarse, self._config.change_threshold)
        self._motion = MotionHistory(coarse)
        self._skin = SkinModel(self._config.prior_skin)
        self._heads = HeadTracks(size, scale, self._config, self._finder, self._person_ids, self._track_ids)
        self._hands = HandTracks(size, self._config, self._track_ids)
        self._people: Mask = np.zeros(coarse.shape[:2], np.uint8)

    def _step(self, image: Image, work: Image, scale: float, step: Step) -> None:
        coarse = coarsened(work)
        if step.periods(GREY_CHECKED_S):
            self.is_grey = is_grey(coarse)
        self._follow_camera(coarse, step)
        views = self._view(image, work, coarse, scale)
        self.skin = views.skin
        self._heads.update(views, self._room, self._motion, self._skin, step)
        persons = self._heads.persons
        if persons:
            blobs = hand_blobs(views, self._skin, self._room, self._motion, persons, self._config)
            blobs = found_hands(views, self._room.unknown, persons, blobs, self._config, step)
            self._hands.update(persons, blobs, step)
            self._find_fingers(persons, views)
        self._people = people_mask(persons, (views.skin.shape[0], views.skin.shape[1]))
        self._room.update(views.coarse, views.changed, self._people, step)
        if step.periods(LEARN_ROOM_S, LEARN_ROOM_AHEAD_S):
            # Clothes count as room: they hide no skin of the colour that is looked for.
            room = np.where((self._people == 0) | (views.skin < self._config.skin_low), 255, 0).astype(np.uint8)
            self._skin.adapt_room(views.coarse, room)

    def _find_fingers(self, persons: list[Person], views: Views) -> None:
        """What colour missed of the hands that are seen, where their fingers matter: not of arms that hang."""
        size = (views.coarse.shape[0], views.coarse.shape[1])
        covered = np.asarray(cv2.bitwise_or(self._room.unknown, head_zone(size, persons, 0.0)), np.uint8)
        for person in persons:
            for hand in person.hands:
                if hand.blob is not None and not person.hangs(hand):
                    hand.blob = with_fingers(hand.blob, views.full, self._room.room, covered, person.width)

    def _follow_camera(self, coarse: Image, step: Step) -> None:
        """Move what is known with the room, where the camera moved."""
        shift = self._camera.update(coarse, self._people, step)
        self.camera_moves = self._camera.moves
        self._room.move(coarse, shift, self._camera.moves)
        self._motion.update(coarse, shift, step)
        if not shift.is_none:
            self._heads.move(shift)
            self._people = people_mask(self._heads.persons, (coarse.shape[0], coarse.shape[1]))

    def _view(self, image: Image, work: Image, coarse: Image, scale: float) -> Views:
        changed = self._room.changed(coarse, self._people)
        # A face of no colour would teach that all that is as bright is skin.
        skin = np.zeros(coarse.shape[:2], np.uint8) if self.is_grey else self._skin.probability(coarse)
        return Views(image, scale, work, coarse, skin, changed)
