"""What a simulated robot says and is to be answered: recorded tracks and head poses of a shipped clip, under its own names."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from deixis_evaluation.clips import load_clips
from deixis_evaluation.references import read_reference
from deixis_evaluation.replay import Given
from deixis_schemas.messages import Belief, CameraInfo, HeadPoses, OfFrame, Poi, Target, Tracks

ROOT = Path(__file__).resolve().parents[1]
CLIPS = ROOT / "examples" / "clips"
REFERENCES = ROOT / "tests" / "replay" / "references"
# Those in which somebody points; robots that follow each other play different ones.
NAMES = ("pointing", "two_persons", "small")
RUNS_APART = 1_000_000

T = TypeVar("T", bound=OfFrame)


@dataclass(frozen=True)
class Recording:
    """A clip as tracker and headpose answered it, frame by frame, with its place and the POIs that are pointed at."""

    name: str
    camera: CameraInfo
    frames: tuple[tuple[Tracks, HeadPoses], ...]
    pois: tuple[Poi, ...]
    answer: tuple[str, ...]

    @property
    def rate_hz(self) -> float:
        """Frames a second; the camera of a clip tells them."""
        assert self.camera.rate_hz
        return self.camera.rate_hz


@dataclass(frozen=True)
class Robot:
    """A robot of the fleet: `answer` is what fusion has to say; its camera's runs are `first_run` and those that follow."""

    name: str
    recording: Recording
    first_run: int

    @property
    def answer(self) -> list[str]:
        """The POIs that are pointed at, by the names that they have on this robot."""
        return [self.own(poi_id) for poi_id in self.recording.answer]

    def own(self, poi_id: str) -> str:
        """Name of a POI on this robot alone, so that another's is known at sight."""
        return f"{self.name}.{poi_id}"

    def site(self) -> dict[str, Any]:
        """Content of this robot's site file."""
        pois = [{"poi_id": self.own(poi.poi_id), "position_m": list(poi.position_m)} for poi in self.recording.pois]
        return {"name": f"place of {self.name}", "pois": pois}

    def foreign(self, message: Belief | Target) -> str:
        """What in a message on this robot's keys is not its own, in words; empty where all is."""
        if not self.first_run <= message.run < self.first_run + RUNS_APART:
            return f"{self.name} is answered about run {message.run}, its own begin with {self.first_run}"
        strangers = [poi_id for poi_id in pois_in(message) if not poi_id.startswith(self.own(""))]
        return f"{self.name} is answered with {', '.join(strangers)}" if strangers else ""


def recorded(name: str) -> Recording:
    """The recording of a shipped clip. Raises ClipError, ReferencesError."""
    (clip,) = load_clips(CLIPS, name)
    given = Given(clip)
    tracks = [message for message in read_reference(REFERENCES, name, "tracker") if isinstance(message, Tracks)]
    poses = [message for message in read_reference(REFERENCES, name, "headpose") if isinstance(message, HeadPoses)]
    said = [message for message in read_reference(REFERENCES, name, "fusion") if isinstance(message, Target)]
    (answer,) = [tuple(target.poi_ids) for target in said if target.final]
    return Recording(name, given.camera(), tuple(zip(tracks, poses, strict=True)), tuple(given.pois()), answer)


def fleet(count: int, first_run: int) -> list[Robot]:
    """So many robots, each with runs of its own."""
    recordings = [recorded(name) for name in NAMES[:count]]
    return [Robot(f"r{i:02d}", recordings[i % len(recordings)], first_run + i * RUNS_APART) for i in range(count)]


def replayed(message: T, run: int, stamp_ns: int) -> T:
    """A recorded message as said of the same frame of a later run."""
    return message.model_copy(update={"run": run, "stamp_ns": stamp_ns})


def pois_in(message: Belief | Target) -> set[str]:
    """The ids of all POIs that a message names as candidates or as the answer."""
    parts = message.persons if isinstance(message, Belief) else [message]
    named = {poi.poi_id for part in parts for poi in part.pois} | {poi_id for part in parts for poi_id in part.credible}
    return named | (set(message.poi_ids) if isinstance(message, Target) else set())
