"""The core of the gesture stage: tracks of a frame -> gestures, one for each person with a face."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from deixis_runtime.lens import Lens
from deixis_schemas.messages import CameraMount, Gesture, Track
from deixis_schemas.runs import RunClock

from .bearing import ARM_SIDES, load_arms
from .config import GestureConfig
from .hand_posture import load_network
from .person import Person, View
from .pointing_odds import frame_odds, stroke_odds

LEVEL = CameraMount()


class GestureRecognizer:
    """Follows the hands of every person. Pure: the same tracks at the same times give the same gestures."""

    def __init__(self, config: GestureConfig) -> None:
        for side in ARM_SIDES:
            load_arms(side)  # now, not within the first pointing
        frame_odds(), stroke_odds(), load_network()
        self._config = config
        self._persons: dict[int, Person] = {}
        self._clock = RunClock()
        self._room_offset_px = (0.0, 0.0)

    @property
    def persons(self) -> Mapping[int, Person]:
        """Who is followed, by `person_id`."""
        return self._persons

    def update(
        self,
        tracks: Sequence[Track],
        width: int,
        height: int,
        lens: Lens,
        run: int,
        stamp_ns: int,
        room_offset_px: tuple[float, float] = (0.0, 0.0),
        mount: CameraMount = LEVEL,
    ) -> list[Gesture]:
        """Gestures of the frame of size `width` x `height`, taken through `lens` at `stamp_ns`, in the order of `person_id`.

        `room_offset_px`: how far the room has moved in the picture since the run began, for the camera moves; `mount`: how
        the camera sits. Another `run` of the camera starts anew. Raises ValueError for an empty frame.
        """
        if width <= 0 or height <= 0:
            raise ValueError(f"width, height: {width} x {height}, must be positive")
        moment = self._clock.advance(run, stamp_ns)
        if moment.new_run:
            self._persons.clear()
        went_px = tuple(now - before for now, before in zip(room_offset_px, self._room_offset_px, strict=True))
        self._room_offset_px = room_offset_px
        if moment.new_run:
            went_px = (0.0, 0.0)
        time_s, view = moment.now_ns * 1e-9, View(lens, (width, height), mount, (went_px[0], went_px[1]))
        of_person: dict[int, list[Track]] = {}
        for track in tracks:
            if track.person_id is not None:
                of_person.setdefault(track.person_id, []).append(track)
        gestures = [self._of_person(key, own, view, time_s, moment.elapsed_s) for key, own in sorted(of_person.items())]
        self._persons = {key: person for key, person in self._persons.items() if not person.is_gone(time_s)}
        return [gesture for gesture in gestures if gesture is not None]

    def _of_person(self, person_id: int, tracks: Sequence[Track], view: View, time_s: float, frame_s: float) -> Gesture | None:
        person = self._persons.get(person_id)
        if person is None:
            if not any(track.kind == "face" for track in tracks):
                return None
            person = self._persons[person_id] = Person(person_id, self._config)
        return person.update(tracks, view, time_s, frame_s)
