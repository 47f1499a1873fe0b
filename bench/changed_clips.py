"""Labelled clips as another camera would have taken them: without colour, or from a robot that turns.

Each is a context in which the changed clips are there as files.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from deixis_evaluation.clips import Clip, load_truth
from numpy.typing import NDArray
from pan import offset_at, shifted

Picture = NDArray[np.uint8]
Change = Callable[[int, Picture], Picture]
"""From the number of a frame and its picture (h, w, 3) to the changed one."""


@contextmanager
def greyed(clips: Sequence[Clip]) -> Iterator[list[Clip]]:
    """The clips without colour."""
    with tempfile.TemporaryDirectory(prefix="deixis-clips-") as folder:
        yield [_written(clip, f"{clip.name}_grey", Path(folder), _grey) for clip in clips]


@contextmanager
def panned(clips: Sequence[Clip], speed_px: int) -> Iterator[list[Clip]]:
    """The clips from a camera that turns forth and back by so many pixels a frame (pan.py), and the labels with it: fusion is
    told how the robot is turned, as a robot tells it.
    """

    def pan(frame: int, picture: Picture) -> Picture:
        return shifted(picture, offset_at(frame, speed_px))

    with tempfile.TemporaryDirectory(prefix="deixis-clips-") as folder:
        written = [_written(clip, f"{clip.name}_panned", Path(folder), pan) for clip in clips]
        yield [replace(new, truth=_turned(old, new, speed_px)) for old, new in zip(clips, written, strict=True)]


def _grey(_: int, picture: Picture) -> Picture:
    return np.asarray(cv2.cvtColor(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR), np.uint8)


def _written(clip: Clip, name: str, folder: Path, change: Change) -> Clip:
    meta, path = clip.truth.meta, folder / f"{name}.mp4"
    read = cv2.VideoCapture(str(clip.video))
    written = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), meta.fps, (meta.width, meta.height))
    for number in range(len(clip.truth.frames)):
        there, picture = read.read()
        if not there:
            break
        written.write(change(number, np.asarray(picture, np.uint8)))
    written.release()
    return replace(clip, name=name, video=path)


def _turned(old: Clip, new: Clip, speed_px: int) -> Any:
    """The labels of a clip whose frames are shifted: places move, and the camera is turned by as much."""
    label = json.loads(old.video.with_suffix(".json").read_text(encoding="utf-8"))
    camera = label["meta"]["camera"]
    still = np.array(camera["R_world_to_cam"]).reshape(3, 3)
    for number, frame in enumerate(label["frames"]):
        dx = offset_at(number, speed_px)
        # A robot turns about the vertical, the world's y, and not about an axis of its tilted camera.
        turn = still @ _about_up(-math.atan2(dx, camera["K"][0][0])) @ still.T
        frame["camera"] = {
            "R_world_to_cam": (turn @ still).ravel().tolist(),
            "t_world_to_cam": (turn @ np.array(camera["t_world_to_cam"])).tolist(),
        }
        for person in frame["persons"]:
            _shift(person, dx, label["meta"]["width"])
            head = person["head"]
            if head.get("center_cam") is not None:
                head["center_cam"] = (turn @ np.array(head["center_cam"])).tolist()
            if head.get("R_cam") is not None:
                head["R_cam"] = (turn @ np.array(head["R_cam"]).reshape(3, 3)).ravel().tolist()
    path = new.video.with_suffix(".json")
    path.write_text(json.dumps(label), encoding="utf-8")
    return load_truth(path)


def _about_up(angle: float) -> NDArray[np.float64]:
    """A rotation of the world (x right, y up)."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])


def _shift(labelled: dict[str, Any], dx: int, width: int) -> None:
    """Move all places in the picture, within a part of a label."""
    for name, value in labelled.items():
        if isinstance(value, dict):
            _shift(value, dx, width)
        elif isinstance(value, list) and name.endswith(("_px", "bbox_visible")):
            value[0] += dx
    if labelled.get("in_frame") and labelled.get("center_px") and not 0 <= labelled["center_px"][0] < width:
        labelled["in_frame"] = False
