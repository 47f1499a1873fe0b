"""Makes this folder's clips from the project's labelled set, which holds more than is shipped: what was done to each, exactly.

    .venv/bin/python examples/clips/derive.py LABELLED_SET examples/clips        (needs ffmpeg with libx264, or FFMPEG=its path)

`pointing`, `wave` and `head_turn` are the set's own videos. Truth is cut down to what is read. Nobody needs to run this again;
it says where the labels of the two clips that are in no set come from.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from deixis_evaluation.clips import load_truth
from deixis_evaluation.true_angles import MIRROR

COPIED = {"pointing": "a02_point_m60", "wave": "a05_wave", "head_turn": "b06_headturn90"}
POINTS, WAVES = "c11_point_p60", "d01_wave_left"
SMALL = "k07_point_p50_gain70"

FOCAL_PX = 560.0
TURN_POINTS_DEG, TURN_WAVES_DEG, PITCH_UP_DEG = -11.0, 21.5, 1.1
SEAM_PX = 296
"""Left of it the one who waves, right of it the one who points."""
DIGITS = {"R_cam": 5}
"""Of what needs more digits than the rest: three would make it no rotation."""

Move = Callable[[float, float], tuple[float, float]]


def main(labelled: Path, out: Path) -> None:
    """Make all five."""
    for name, source in COPIED.items():
        if name != "pointing":  # a link to ../pointing.mp4
            shutil.copyfile(labelled / f"{source}.mp4", out / f"{name}.mp4")
        write_truth(out / f"{name}.json", truth_of(labelled / f"{source}.json"))
    small(labelled, out)
    two_persons(labelled, out)


def small(labelled: Path, out: Path) -> None:
    """Half the size at half the rate. Pixel centres are whole numbers, so that u becomes (u + 1/2) / 2 - 1/2."""
    truth = truth_of(labelled / f"{SMALL}.json")
    pictures = [
        cv2.resize(picture, (320, 240), interpolation=cv2.INTER_AREA)
        for index, picture in enumerate(pictures_of(labelled / f"{SMALL}.mp4"))
        if index % 2 == 0
    ]
    encode(out / "small.mp4", pictures, 15)
    meta, matrix = truth["meta"], truth["meta"]["camera"]["K"]
    for row in matrix[:2]:
        row[:] = [row[0] / 2, row[1] / 2, (row[2] + 0.5) / 2 - 0.5]
    meta |= {"fps": 15, "width": 320, "height": 240}
    truth["frames"] = truth["frames"][::2]
    for index, frame in enumerate(truth["frames"]):
        frame["frame"] = index
        for person in frame["persons"]:
            move_person(person, lambda x, y: ((x + 0.5) / 2 - 0.5, (y + 0.5) / 2 - 0.5))
    write_truth(out / "small.json", truth)


def two_persons(labelled: Path, out: Path) -> None:
    """One waves while another points: two clips of one room side by side, each with its camera turned about its centre.

    Turning a camera about its centre maps its picture by a homography and changes neither where a person stands nor what is
    seen of them, so that all angles and distances stay true.
    """
    truth, other = (truth_of(labelled / f"{name}.json") for name in (POINTS, WAVES))
    pictures = []
    left, right = Turn(other, TURN_WAVES_DEG), Turn(truth, TURN_POINTS_DEG)
    for waves, points in zip(pictures_of(labelled / f"{WAVES}.mp4"), pictures_of(labelled / f"{POINTS}.mp4"), strict=True):
        shown = right.picture(points)
        shown[:, :SEAM_PX] = left.picture(waves)[:, :SEAM_PX]
        pictures.append(shown)
    encode(out / "two_persons.mp4", pictures, 30)
    for frame, beside_frame in zip(truth["frames"], other["frames"], strict=True):
        (person,), (waving,) = frame["persons"], beside_frame["persons"]
        right.person(person)
        left.person(waving)
        frame["persons"].append(waving | {"id": 1})
    truth["meta"]["kind"] = "two"
    write_truth(out / "two_persons.json", truth)


class Turn:
    """A clip's camera turned to the right, and to the common tilt and focal length; the clip's truth names it from now on."""

    def __init__(self, truth: dict[str, Any], angle_deg: float) -> None:
        camera = truth["meta"]["camera"]
        before = np.array(camera["R_world_to_cam"]).reshape(3, 3)
        centre = -before.T @ np.array(camera["t_world_to_cam"])
        after = rotation_of(angle_deg, PITCH_UP_DEG)
        matrix = np.array([[FOCAL_PX, 0, 319.5], [0, FOCAL_PX, 239.5], [0, 0, 1]])
        self._turn = math.radians(angle_deg)
        self._rotation = after @ before.T
        self._homography = matrix @ self._rotation @ np.linalg.inv(camera["K"])
        camera |= {
            "K": matrix.tolist(),
            "R_world_to_cam": after.ravel().tolist(),
            "t_world_to_cam": (-after @ centre).tolist(),
            "pitch_up_deg": PITCH_UP_DEG,
        }

    def picture(self, picture: np.ndarray) -> np.ndarray:
        """What the turned camera sees; beyond the old picture its edge goes on."""
        flags, border = cv2.INTER_CUBIC, cv2.BORDER_REPLICATE
        return cv2.warpPerspective(picture, self._homography, picture.shape[1::-1], flags=flags, borderMode=border)

    def person(self, person: dict[str, Any]) -> None:
        """Change a person's labels to what the turned camera sees."""
        move_person(person, self._move)
        head = person["head"]
        head["center_cam"] = (self._rotation @ head["center_cam"]).tolist()
        turned = MIRROR @ self._rotation @ MIRROR @ np.array(head["R_cam"]).reshape(3, 3)
        head["R_cam"] = turned.ravel().tolist()
        x, y = person["user_pos"]["robot_xy"]
        # The map's forward axis turns with the camera, to the right.
        cosine, sine = math.cos(self._turn), math.sin(self._turn)
        person["user_pos"]["robot_xy"] = [x * cosine - y * sine, x * sine + y * cosine]

    def _move(self, x: float, y: float) -> tuple[float, float]:
        u, v, w = self._homography @ (x, y, 1.0)
        return float(u / w), float(v / w)


def rotation_of(turn_deg: float, pitch_up_deg: float) -> np.ndarray:
    """World (x to the right, y up, z toward the camera) to camera axes (x right, y down, z ahead), 3 x 3."""
    turn, tilt = math.radians(turn_deg), math.radians(pitch_up_deg)
    ahead = np.array([math.sin(turn) * math.cos(tilt), math.sin(tilt), -math.cos(turn) * math.cos(tilt)])
    across = np.array([math.cos(turn), 0.0, math.sin(turn)])
    return np.stack([across, np.cross(ahead, across), ahead])


def move_person(person: dict[str, Any], move: Move) -> None:
    """Move all that a person's labels say in pixels."""
    person["head"]["center_px"] = move(*person["head"]["center_px"])
    for part in (person["face"], *person["hands"].values()):
        anchor = part.get("center_px") or part.get("centroid_visible_px")
        if anchor is not None:
            part["visible_px"] = round(part["visible_px"] * magnification(move, *anchor))
        for name in ("center_px", "centroid_visible_px"):
            if part.get(name) is not None:
                part[name] = move(*part[name])
        if part.get("bbox_visible") is not None:
            part["bbox_visible"] = move_box(move, *part["bbox_visible"])


def move_box(move: Move, x: float, y: float, width: float, height: float) -> list[float]:
    """The box around a moved box; its edges are half a pixel outside of its pixels' centres."""
    edges = [move(u, v) for u in (x - 0.5, x + width - 0.5) for v in (y - 0.5, y + height - 0.5)]
    left, top = (min(values) for values in zip(*edges, strict=True))
    right, bottom = (max(values) for values in zip(*edges, strict=True))
    return [left + 0.5, top + 0.5, right - left, bottom - top]


def magnification(move: Move, x: float, y: float) -> float:
    """How much larger areas become about a point."""
    (a, b), (c, d), (e, f) = move(x, y), move(x + 1, y), move(x, y + 1)
    return abs((c - a) * (f - b) - (d - b) * (e - a))


def truth_of(path: Path) -> dict[str, Any]:
    """What is read of a label file, and the heads' depth."""
    whole = json.loads(path.read_text())
    kept = load_truth(path).model_dump(mode="json", exclude_none=True)
    for frame, all_of_it in zip(kept["frames"], whole["frames"], strict=True):
        for person, source in zip(frame["persons"], all_of_it["persons"], strict=True):
            person["head"]["center_cam"] = source["head"]["center_cam"]
    return kept


def write_truth(path: Path, truth: dict[str, Any]) -> None:
    """One frame a line."""
    lines = ",\n".join(json.dumps(short(frame), separators=(",", ":")) for frame in truth["frames"])
    meta = json.dumps(short(truth["meta"], 6), separators=(",", ":"))
    path.write_text(f'{{"meta":{meta},\n"frames":[\n{lines}\n]}}\n')


def short(value: Any, digits: int = 3) -> Any:
    """Without the digits that mean nothing."""
    if isinstance(value, float):
        return round(value, digits)
    if isinstance(value, dict):
        return {name: short(item, DIGITS.get(name, digits)) for name, item in value.items()}
    return [short(item, digits) for item in value] if isinstance(value, list | tuple) else value


def pictures_of(path: Path) -> Iterator[np.ndarray]:
    """All frames of a video."""
    video = cv2.VideoCapture(str(path))
    while (read := video.read())[0]:
        yield read[1]


def encode(path: Path, pictures: Iterable[np.ndarray], fps: int) -> None:
    """H.264 at the quality of the labelled set."""
    pictures = list(pictures)
    height, width = pictures[0].shape[:2]
    command = [os.environ.get("FFMPEG", "ffmpeg"), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "bgr24"]
    command += ["-s", f"{width}x{height}", "-r", str(fps), "-i", "-", "-c:v", "libx264", "-crf", "20", "-preset", "slow"]
    command += ["-pix_fmt", "yuv420p", "-movflags", "+faststart", str(path)]
    subprocess.run(command, input=b"".join(picture.tobytes() for picture in pictures), check=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
