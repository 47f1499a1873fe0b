"""Heads of real and of rendered people: how many faces are found, how many yaws answered, how far off, and false episodes."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from deixis_evaluation.chain import Answers, Chain, camera_of
from deixis_evaluation.clips import Clip
from deixis_evaluation.matching import FACE_MARGIN, MIN_FACE_PX, finds_face
from deixis_evaluation.replay import Picture
from deixis_schemas.messages import HeadPose, Track

# Neither set says its lens: a usual webcam.
ASSUMED_FOV_DEG = 60.0
# Stills of drivers follow each other in order, but with jumps: each is shown for three frames, so that heads are found again.
SHOWN, FPS = 3, 30.0
LATERAL_DEG = 30.0


@dataclass
class Heads:
    """Counts over frames in which a face is there. `yaw_errors_deg` only where the yaw is labelled and was tracked.

    quiet_s: seconds in which nobody points; episodes: pointing episodes in these.
    """

    frames: int = 0
    found: int = 0
    answered: int = 0
    frontal_errors_deg: list[float] | None = None
    lateral_errors_deg: list[float] | None = None
    quiet_s: float = 0.0
    episodes: int = 0

    def count(self, track: Track | None, poses: list[HeadPose], true_yaw_deg: float | None) -> None:
        """One frame with a face: the track on it, none where it was not found."""
        self.frames += 1
        if track is None:
            return
        self.found += 1
        pose = next((pose for pose in poses if pose.person_id == track.person_id), None)
        if pose is None or pose.status not in ("tracking", "out_of_range"):
            return
        self.answered += 1
        if pose.yaw_deg is not None and true_yaw_deg is not None:
            self._note(abs(pose.yaw_deg - true_yaw_deg), true_yaw_deg)

    def _note(self, error_deg: float, true_yaw_deg: float) -> None:
        if abs(true_yaw_deg) < LATERAL_DEG:
            self.frontal_errors_deg = [*(self.frontal_errors_deg or []), error_deg]
        else:
            self.lateral_errors_deg = [*(self.lateral_errors_deg or []), error_deg]

    def figures(self) -> dict[str, float | None]:
        """The columns of the table."""
        return {
            "frames": float(self.frames),
            "faces_found_share": self.found / self.frames if self.frames else None,
            "yaw_answered_share": self.answered / self.frames if self.frames else None,
            "yaw_error_deg_below_30": _mean(self.frontal_errors_deg),
            "yaw_error_deg_30_and_more": _mean(self.lateral_errors_deg),
            "false_episodes_per_minute": 60 * self.episodes / self.quiet_s if self.quiet_s else None,
        }


def signers(folder: Path) -> Heads:
    """People who sign and never point; one of them is in every frame. Yaw is not labelled. `folder`: asl_clips."""
    heads = Heads()
    for path in sorted(folder.glob("*.mkv")):
        chain: Chain | None = None
        for number, picture in enumerate(pictures_of(path)):
            chain = chain or _chain_of(picture)
            said = chain.see(picture, number / FPS)
            heads.count(_any_face(said), said.poses.poses, None)
            heads.episodes += len(said.targets)
            heads.quiet_s += 1 / FPS
        heads.episodes += len(chain.end()) if chain else 0
    return heads


def drivers(folder: Path) -> Heads:
    """Drivers, whose yaw is labelled in steps of 15 degrees. `folder`: drivface."""
    heads, last, chain, frame = Heads(), "", None, 0
    with (folder / "drivPoints.txt").open(encoding="utf-8") as lines:
        rows = [row for row in csv.DictReader(lines) if (folder / f"{row['fileName']}.jpg").exists()]
    for row in rows:
        picture = _read(folder / f"{row['fileName']}.jpg")
        if chain is None or row["subject"] != last:
            chain, last = _chain_of(picture), row["subject"]
        for _ in range(SHOWN):
            said = chain.see(picture, frame / FPS)
            frame += 1
        box = (float(row["xF"]), float(row["yF"]), float(row["wF"]), float(row["hF"]))
        on_it = next((track for track in said.tracks.tracks if _is_on(track, box)), None)
        heads.count(on_it, said.poses.poses, float(row["ang"]))
    return heads


def rendered(clips: list[Clip]) -> Heads:
    """Rendered people. Episodes count in clips in which nobody points."""
    heads = Heads()
    for clip in clips:
        meta = clip.truth.meta
        chain = Chain(camera_of(meta.width, meta.height, meta.camera.K[0][0]))
        quiet = not any(person.points for frame in clip.truth.frames for person in frame.persons)
        for frame, picture in zip(clip.truth.frames, pictures_of(clip.video), strict=False):
            said = chain.see(picture, frame.frame / meta.fps)
            heads.quiet_s += quiet / meta.fps
            heads.episodes += len(said.targets) if quiet else 0
            for person in frame.persons:
                if person.face.visible_px >= MIN_FACE_PX:
                    own = next((t for t in said.tracks.tracks if finds_face(t, person, clip.truth)), None)
                    heads.count(own, said.poses.poses, person.head.yaw_rel_deg)
        heads.episodes += len(chain.end()) if quiet else 0
    return heads


def pictures_of(path: Path) -> Iterator[Picture]:
    """The frames of a video, BGR. Raises ValueError for one that has none."""
    video, count = cv2.VideoCapture(str(path)), 0
    try:
        while (read := video.read())[0]:
            count += 1
            yield np.asarray(read[1], np.uint8)
    finally:
        video.release()
    if not count:
        raise ValueError(f"'{path}' is no video")


def _chain_of(picture: Picture) -> Chain:
    height, width = picture.shape[:2]
    return Chain(camera_of(width, height, width / 2 / math.tan(math.radians(ASSUMED_FOV_DEG) / 2)))


def _any_face(said: Answers) -> Track | None:
    return next((track for track in said.tracks.tracks if track.kind == "face" and track.observed), None)


def _is_on(track: Track, box: tuple[float, float, float, float]) -> bool:
    x, y, w, h = box
    dx, dy = track.centroid_px[0] - x - w / 2, track.centroid_px[1] - y - h / 2
    return track.kind == "face" and abs(dx) <= (0.5 + FACE_MARGIN) * w and abs(dy) <= (0.5 + FACE_MARGIN) * h


def _read(path: Path) -> Picture:
    picture = cv2.imread(str(path))
    if picture is None:
        raise ValueError(f"'{path}' is no picture")
    return np.asarray(picture, np.uint8)


def _mean(values: list[float] | None) -> float | None:
    return float(np.mean(values)) if values else None
