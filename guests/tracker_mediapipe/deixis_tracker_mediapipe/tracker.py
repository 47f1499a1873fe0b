"""The guest tracker: frames in, face and hand tracks out. One instance per camera."""

from __future__ import annotations

import numpy as np
from deixis_schemas.messages import Track
from deixis_schemas.runs import RunClock

from .config import TrackerConfig
from .finders import FaceFinder, HandFinder, rgb_of
from .messages import tracks_of
from .persons import Persons
from .room import Room
from .seen import HandSeen, Picture

LEAST_SIDE_PX = 32


class FrameRefused(ValueError):
    """An array that is no frame."""


class Tracker:
    """Finds faces in the whole picture, about each person's face the hands, and how the room moves behind them."""

    def __init__(self, config: TrackerConfig) -> None:
        self._config = config
        self._clock = RunClock()
        self._shape: tuple[int, int] = (0, 0)
        self._faces = FaceFinder(config.face_confidence)
        # A graph takes a tenth of a second to make: the first one now, and not within a frame.
        self._free = [HandFinder(config)]
        self._hands: dict[int, HandFinder] = {}
        self.persons = Persons(config)
        self.room = Room()

    def update(self, image: Picture, run: int, stamp_ns: int) -> list[Track]:
        """Track one frame: (H, W, 3) uint8 BGR, of that run of the camera, captured at `stamp_ns`; tracks in its pixels.

        A frame of another run or another size starts anew. Raises FrameRefused for another type, shape or size of array.
        """
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise FrameRefused(f"image: {image.dtype} {image.shape}, but a frame is uint8 (height, width, 3)")
        height, width = image.shape[:2]
        if min(height, width) < LEAST_SIDE_PX:
            raise FrameRefused(f"image: {width} x {height}, but the smallest frame is {LEAST_SIDE_PX} x {LEAST_SIDE_PX}")
        moment = self._clock.advance(run, stamp_ns)
        if moment.new_run or self._shape != (height, width):
            self._shape = height, width
            self.persons.forget()
            self.room.forget()
        rgb = rgb_of(image)
        self.persons.see_faces(self._faces.find(rgb), moment.now_ns * 1e-9)
        self.persons.see_hands(self._find_hands(rgb))
        self.room.see(rgb, [(person.centre, person.width) for person in self.persons.shown])
        return [track for person in self.persons.shown for track in tracks_of(person)]

    def _find_hands(self, rgb: Picture) -> list[HandSeen]:
        regions = self.persons.regions((rgb.shape[1], rgb.shape[0]))
        for gone in self._hands.keys() - regions.keys():
            finder = self._hands.pop(gone)
            finder.forget()
            self._free.append(finder)
        found = []
        for person_id, region in regions.items():
            found += self._finder_of(person_id).find(rgb, region)
        return found

    def _finder_of(self, person_id: int) -> HandFinder:
        """The person's own: it follows hands from frame to frame. There are as many as people were seen at once."""
        if person_id not in self._hands:
            made = self._free.pop() if self._free else HandFinder(self._config)
            self._hands[person_id] = made
        return self._hands[person_id]
