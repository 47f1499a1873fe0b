"""What every head pose method is given: the frames of a clip or of a folder of pictures, with the tracks of the one tracker."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from deixis_evaluation.clips import Box, Clip
from deixis_evaluation.replay import RUN, START_NS, Given, Picture
from deixis_runtime.lens import Lens
from deixis_schemas.messages import Track
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker
from real_heads import ASSUMED_FOV_DEG, FPS, SHOWN, pictures_of


@dataclass(frozen=True)
class Seen:
    """One frame: picture (h, w, 3) BGR, its tracks, capture time."""

    picture: Picture
    tracks: list[Track]
    stamp_ns: int

    @property
    def faces(self) -> list[Track]:
        """Face tracks of known persons."""
        return [track for track in self.tracks if track.kind == "face" and track.person_id is not None]


@dataclass(frozen=True)
class Source:
    """Where pictures come from. name: of its own among all. paths: a video, or pictures.

    focal_px: none for a lens that nobody told, then taken for one of ASSUMED_FOV_DEG. shown: frames for each picture.
    """

    name: str
    paths: tuple[Path, ...]
    focal_px: float | None = None
    shown: int = 1


@dataclass(frozen=True)
class Footage:
    """Frames of one camera in order."""

    source: Source
    frames: list[Seen]
    lens: Lens

    @property
    def face_count(self) -> int:
        """Faces of all frames: what the time of a method is shared among."""
        return sum(len(frame.faces) for frame in self.frames)


@dataclass(frozen=True)
class Labelled:
    """A picture of a driver: yaw (degrees, toward image right) and face box (x, y, w, h)."""

    path: Path
    driver: str
    yaw_deg: float
    box: Box


def clip_source(clip: Clip) -> Source:
    """A labelled clip."""
    return Source(f"clip/{clip.name}", (clip.video,), clip.truth.meta.camera.K[0][0])


def signer_sources(folder: Path) -> list[Source]:
    """The videos of people who sign. `folder`: asl_clips."""
    return [Source(f"signer/{path.stem}", (path,)) for path in sorted(folder.glob("*.mkv"))]


def driver_source(driver: str, pictures: list[Labelled]) -> Source:
    """Pictures of one driver, each shown as real_heads does."""
    return Source(f"driver/{driver}", tuple(item.path for item in pictures), shown=SHOWN)


def footage_of_clip(clip: Clip) -> Footage:
    """The frames of a labelled clip. Raises ReplayError."""
    given = Given(clip)
    frames = _tracked((picture, frame.stamp_ns) for frame, picture in given.pictures())
    return Footage(clip_source(clip), frames, Lens.of(given.camera()))


def footage_of(source: Source) -> Footage:
    """The frames of a source without labels of its own. Raises ValueError for one that cannot be read."""
    pictures = (picture for path in source.paths for picture in _pictures(path) for _ in range(source.shown))
    frames = _tracked((picture, START_NS + round(number * 1e9 / FPS)) for number, picture in enumerate(pictures))
    height, width = frames[0].picture.shape[:2]
    return Footage(source, frames, Lens.assumed(width, height, ASSUMED_FOV_DEG))


def labelled_drivers(folder: Path) -> dict[str, list[Labelled]]:
    """The pictures of drivface that are there, by driver, in driving order. `folder`: drivface."""
    drivers: dict[str, list[Labelled]] = {}
    with (folder / "drivPoints.txt").open(encoding="utf-8") as lines:
        for row in csv.DictReader(lines):
            path = folder / f"{row['fileName']}.jpg"
            if path.exists():
                box = (float(row["xF"]), float(row["yF"]), float(row["wF"]), float(row["hF"]))
                drivers.setdefault(row["subject"], []).append(Labelled(path, row["subject"], float(row["ang"]), box))
    return drivers


def _tracked(pictures: Iterable[tuple[Picture, int]]) -> list[Seen]:
    tracker = Tracker(TrackerConfig())
    return [Seen(picture, list(tracker.update(picture, RUN, stamp_ns)), stamp_ns) for picture, stamp_ns in pictures]


def _pictures(path: Path) -> Iterable[Picture]:
    if path.suffix != ".jpg":
        return pictures_of(path)
    picture = cv2.imread(str(path))
    if picture is None:
        raise ValueError(f"'{path}' is no picture")
    return (np.asarray(picture, np.uint8),)
