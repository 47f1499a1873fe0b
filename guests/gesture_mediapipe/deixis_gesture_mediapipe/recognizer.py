"""The guest's core: tracks of a frame and how to read a hand of it -> gestures, one for each person with a face. Pure."""

from __future__ import annotations

from deixis_runtime.lens import Lens
from deixis_schemas.messages import CameraMount, Gesture, Track, Tracks
from deixis_schemas.runs import RunClock

from .config import GestureConfig
from .person import Person, ReadHand


class GestureRecognizer:
    """Follows the hands of every person."""

    def __init__(self, config: GestureConfig) -> None:
        self._config = config
        self._clock = RunClock()
        self._persons: dict[int, Person] = {}

    def update(self, seen: Tracks, lens: Lens, mount: CameraMount, read_hand: ReadHand) -> list[Gesture]:
        """Gestures of a frame taken through `lens`, in the order of `person_id`. Another run of the camera starts anew."""
        moment = self._clock.advance(seen.run, seen.stamp_ns)
        if moment.new_run:
            self._persons = {}
        now_s, of_person = moment.now_ns * 1e-9, _by_person(seen)
        for person_id, tracks in of_person.items():
            if person_id not in self._persons:
                if not any(track.kind == "face" for track in tracks):
                    continue
                self._persons[person_id] = Person(person_id, self._config)
            self._persons[person_id].see(tracks, now_s, read_hand)
        self._persons = {key: person for key, person in self._persons.items() if not person.is_gone(now_s)}
        size = seen.width, seen.height
        shown = sorted(self._persons.keys() & of_person.keys())
        return [self._persons[person_id].gesture(lens, size, mount) for person_id in shown]


def _by_person(seen: Tracks) -> dict[int, list[Track]]:
    found: dict[int, list[Track]] = {}
    for track in seen.tracks:
        if track.person_id is not None:
            found.setdefault(track.person_id, []).append(track)
    return found
