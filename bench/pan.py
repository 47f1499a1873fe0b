"""What a turning camera leaves of the tracks and of the gestures: the same clips still, and panned.

usage: python bench/pan.py [--data DIR] [--only-clips PATTERN] [--px N ...] [--json FILE]

Each frame is shifted sideways, a few pixels more than the one before, forth and back over +-80 pixels, what is laid bare filled
with the mirror image of what is beside it. Tracker and gesture stage see the shifted clip; their tracks are shifted back and
compared with the truth. By pixels a frame:
* faces, raised_hands: found, by frames; false_hands: tracks on nobody's hand, a frame;
* pointing: of the frames of true pointing strokes, how many are answered as the stroke of one.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from deixis_evaluation.blob_scores import BlobScores, score_blobs
from deixis_evaluation.clips import Clip, ClipError, load_clips
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_evaluation.recording import Recording
from deixis_evaluation.replay import INSTANCE, Given
from deixis_gesture.config import GestureConfig
from deixis_gesture.recognizer import GestureRecognizer
from deixis_runtime.lens import Lens
from deixis_schemas.messages import Gesture, OfFrame, Producer, Track, Tracks
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.table import Table

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "rendered"
SPEEDS_PX = (0, 1, 2, 4)
REACH_PX = 80
POINTING = ("point_left", "point_right", "invisible")


@dataclass
class Left:
    """What was found at one speed."""

    blobs: BlobScores
    pointing: int = 0
    of: int = 0

    def figures(self) -> dict[str, float | None]:
        """By name."""
        return {
            "faces": self.blobs.faces.share,
            "raised_hands": self.blobs.raised_hands.share,
            "false_hands": self.blobs.false_hands_per_frame,
            "pointing": self.pointing / self.of if self.of else None,
        }


def offset_at(frame: int, speed_px: int) -> int:
    """How far a frame is shifted to the right: forth and back."""
    along = (frame * speed_px + REACH_PX) % (4 * REACH_PX)
    return REACH_PX - abs(along - 2 * REACH_PX) if speed_px else 0


def shifted(picture: NDArray[np.uint8], dx: int) -> NDArray[np.uint8]:
    """The picture (h, w, 3) moved to the right."""
    warp, size = np.array([[1.0, 0, dx], [0, 1, 0]]), picture.shape[1::-1]
    return np.asarray(cv2.warpAffine(picture, warp, size, flags=cv2.INTER_NEAREST, borderMode=cv2.BORDER_REFLECT_101), np.uint8)


def moved(track: Track, dx: int) -> Track:
    """A track of the shifted picture in the clip's; its outline stays, for nobody looks at it here."""
    (x, y), (left, top, width, height) = track.centroid_px, track.bbox_px
    return track.model_copy(update={"centroid_px": (x - dx, y), "bbox_px": (left - dx, top, width, height)})


def measure(clip: Clip, speed_px: int) -> Left:
    """Play one clip."""
    given, recording = Given(clip), Recording()
    lens, tracker, recognizer = Lens.of(given.camera()), Tracker(TrackerConfig()), GestureRecognizer(GestureConfig())
    left = Left(BlobScores())
    for frame, picture in given.pictures():
        dx = offset_at(frame.seq, speed_px)
        tracks = tracker.update(shifted(picture, dx), frame.run, frame.stamp_ns)
        recording.add(told(frame, picture, [moved(track, dx) for track in tracks]), frame.stamp_ns)
        height, width, _ = picture.shape
        offset = tracker.room_offset_px
        gestures = recognizer.update(tracks, width, height, lens, frame.run, frame.stamp_ns, offset)
        if any(person.points for person in clip.truth.frames[frame.seq].persons):
            left.of += 1
            left.pointing += any(map(is_pointing, gestures))
    left.blobs = score_blobs(clip.truth, recording)
    return left


def told(frame: OfFrame, picture: NDArray[np.uint8], tracks: list[Track]) -> Tracks:
    """The message of a frame."""
    height, width = picture.shape[:2]
    return Tracks.derive(frame, Producer("tracker", INSTANCE), width=width, height=height, tracks=tracks)


def is_pointing(gesture: Gesture) -> bool:
    """Whether the stage says that somebody points now."""
    return gesture.phase == "stroke" and gesture.gesture in POINTING


def measure_all(clips: list[Clip], speed_px: int) -> Left:
    """All clips as one."""
    parts = [measure(clip, speed_px) for clip in clips]
    blobs = sum((part.blobs for part in parts), BlobScores())
    return Left(blobs, sum(part.pointing for part in parts), sum(part.of for part in parts))


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=DATA, help="folder of labelled clips (default: ../shared/data/rendered)")
    parser.add_argument("--only-clips", default="c*", metavar="PATTERN", help="clips to play (default: c*, the pointings)")
    parser.add_argument("--px", type=int, nargs="+", default=list(SPEEDS_PX), help="pixels a frame (default: 0 1 2 4)")
    parser.add_argument("--json", type=Path, metavar="FILE")
    given = parser.parse_args()
    cv2.setNumThreads(1)
    try:
        clips = load_clips(given.data, given.only_clips)
    except ClipError as error:
        print(f"pan: {error}", file=sys.stderr)
        return 2
    figures: dict[str, dict[str, Any]] = {}
    for speed_px in given.px:
        figures[f"{speed_px}"] = measure_all(clips, speed_px).figures()
    table = Table("pixels a frame", title=f"Panned, {len(clips)} clips", box=box.SIMPLE_HEAD, title_justify="left")
    for name in next(iter(figures.values())):
        table.add_column(name.replace("_", " "), justify="right")
    for speed, values in figures.items():
        table.add_row(speed, *("-" if value is None else f"{value:.2f}" for value in values.values()))
    machine = describe_machine()
    console = Console()
    console.print(table)
    console.print(say_machine(machine), style="dim", markup=False, soft_wrap=True)
    if given.json:
        flat = {f"{name}_{speed}px": value for speed, values in figures.items() for name, value in values.items()}
        given.json.write_text(json.dumps({"machine": machine, "figures": flat}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
