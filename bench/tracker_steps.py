"""Plays clips to the tracker's core and tells the processor's time by step. bench/tracker.py starts it.

usage: python bench/tracker_steps.py CLIP... > ANSWERS

ANSWERS: {CLIP: {"frames", "cpu_ms": a frame, "steps": {step: ms a frame}, "faces" and "hands": tracked a frame, "digest": of
all that was answered}}. A step's time is its own, without that of steps inside it; what belongs to none is "other". OpenCV has
one thread, as in the stage. Another source tree's tracker is measured by PYTHONPATH=TREE/services/tracker.
"""

from __future__ import annotations

import functools
import hashlib
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import cv2
import deixis_tracker.tracker as core
import numpy as np
from deixis_tracker.config import TrackerConfig
from deixis_tracker.frame import Image

STEPS: dict[str, tuple[str, ...]] = {
    "shrink": ("frame.coarsened",),
    "camera motion": ("camera_motion.CameraMotion.update",),
    "background": (
        *(f"background.Background.{name}" for name in ("move", "changed", "remove_shadow", "update")),
        "background.MotionHistory.update",
    ),
    "skin": tuple(f"skin.SkinModel.{name}" for name in ("probability", "adapt_person", "adapt_room", "adapt_clothes")),
    "finder's network": ("finder.Finder.maps",),
    "finder": (
        *(f"finder.Finder.{name}" for name in ("around", "over")),
        *(f"finder.Surroundings.{name}" for name in ("heads", "hands", "odds_near")),
    ),
    "head search": tuple(f"head_search.HeadSearch.{name}" for name in ("search", "confirmed")),
    "head colours": ("heads.HeadFinder.find", "heads.HeadColours.learn"),
    "faces": ("faces.look", "faces.measure"),
    "heads": ("head_tracks.HeadTracks.update",),
    "hand blobs": ("segmentation.hand_blobs", "found_hands.found_hands"),
    "cutting hands": tuple(f"hands.{name}" for name in ("cut_hand", "hand_about", "thickness")),
    "hypotheses": tuple(f"hypotheses.{name}" for name in ("propagate", "support", "cells_of", "sample_pixels", "best_tracks")),
    "classifier": ("classifier.HandBelief.update", "classifier.label"),
    "hand tracks": ("hand_tracks.HandTracks.update",),
    "answers": ("persons.tracks_of", "persons.people_mask"),
}
"""What of deixis_tracker belongs to which step."""
OTHER = "other"
PACKAGE = "deixis_tracker"
PERIOD_NS = 33_333_333


class Stopwatch:
    """Processor time of steps, each its own: a step inside another stops the other's."""

    def __init__(self) -> None:
        self.spent_ns: Counter[str] = Counter()
        self._running = [OTHER]
        self._since_ns = time.process_time_ns()

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """What runs inside counts for that step."""
        self._turn()
        self._running.append(name)
        try:
            yield
        finally:
            self._turn()
            self._running.pop()

    def wrap(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function as part of a step."""

        @functools.wraps(function)
        def timed(*args: Any, **kwargs: Any) -> Any:
            with self.step(name):
                return function(*args, **kwargs)

        return timed

    def _turn(self) -> None:
        now_ns = time.process_time_ns()
        self.spent_ns[self._running[-1]] += now_ns - self._since_ns
        self._since_ns = now_ns


def attach(watch: Stopwatch) -> None:
    """Let the watch time all steps. A part that a source tree does not have is left out."""
    for step, parts in STEPS.items():
        for part in parts:
            module, _, name = part.partition(".")
            owner, _, method = name.partition(".")
            held = getattr(sys.modules.get(f"{PACKAGE}.{module}"), owner, None)
            if method and held is not None and hasattr(held, method):
                setattr(held, method, watch.wrap(step, getattr(held, method)))
            elif not method and held is not None:
                _replace(held, watch.wrap(step, held))


def _replace(function: Any, timed: Callable[..., Any]) -> None:
    """Put a function's timed form wherever the package holds the function."""
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        module = sys.modules[name]
        for held in [key for key, value in vars(module).items() if value is function]:
            setattr(module, held, timed)


def frames_of(clip: str) -> list[Image]:
    """All frames (h, w, 3) BGR, decoded ahead of what is timed. Raises ValueError for what is no video."""
    video, frames = cv2.VideoCapture(clip), []
    while (read := video.read())[0]:
        frames.append(np.asarray(read[1], np.uint8))
    video.release()
    if not frames:
        raise ValueError(f"'{clip}' is not a video")
    return frames


def play(frames: list[Image], watch: Stopwatch) -> dict[str, Any]:
    """What the frames cost, and what was answered."""
    tracker, digest, found = core.Tracker(TrackerConfig()), hashlib.sha256(), Counter[str]()
    tracker.update(np.zeros_like(frames[0]), 0, 0)  # the first evaluation of the network lays out its memory
    watch.spent_ns.clear()
    spent_ns = 0
    for number, frame in enumerate(frames):
        begun_ns = time.process_time_ns()
        with watch.step(OTHER):
            tracks = tracker.update(frame, 1, number * PERIOD_NS)
        spent_ns += time.process_time_ns() - begun_ns
        found.update("faces" if track.kind == "face" else "hands" for track in tracks)
        digest.update(repr(tracks).encode())
    ms = 1e-6 / len(frames)
    steps = {step: watch.spent_ns[step] * ms for step in STEPS}
    cpu_ms = spent_ns * ms
    return {
        "frames": len(frames),
        "cpu_ms": cpu_ms,
        "steps": {**steps, OTHER: max(0.0, cpu_ms - sum(steps.values()))},
        "faces": found["faces"] / len(frames),
        "hands": found["hands"] / len(frames),
        "digest": digest.hexdigest(),
    }


def main(clips: list[str]) -> int:
    cv2.setNumThreads(1)
    watch = Stopwatch()
    attach(watch)
    try:
        answers = {clip: play(frames_of(clip), watch) for clip in clips}
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    json.dump(answers, sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
