"""Faces seen from the front, by Haar cascades (Viola and Jones 2001): searched for, looked at again, measured.

A full search of a VGA picture takes about 100 ms, so it is cut into jobs (one scale, one strip of the picture) and each
frame does a few. Hits become candidates which are looked at again in the next frames, in their neighbourhood only; single
hits land on shirts and furniture, so a face is believed after several hits in separate frames, with skin in its middle.

How wide and where the box of the cascade is on a face depends by up to 12 % on the size at which the cascade sees it. So a
place is looked at quickly at one size, and measured at several in turn, whose mean counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import cv2
import cv2.data
import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import FrontalFace

from deixis_tracker.config import TrackerConfig
from deixis_tracker.frame import COARSE, Box, Image, Step, Views, around

FRONTAL = "haarcascade_frontalface_alt2"
WINDOW_PX = 20  # of that cascade
SCALE_STEP = 1.17
MISSES_ALLOWED, MOST_LOOKS = 3, 30  # looks, not frames: each is one more witness, however many there are in a second
LOOK_S = 1 / 30  # at candidates
LEAST_SKIN = 0.12
SEARCH_S = 0.1  # once somebody is tracked; before, in each frame
LOOKED_AT_PX = 32  # a place that is looked at is scaled to this width of a face
MEASURED_AT_PX = (56.0, 62.0, 68.0)
MEASURED_BOX_M, MEASURED_BOX_DROP_M = 0.197, 0.006  # width of the box so measured, and how far below the head's centre it is


class Job(NamedTuple):
    """One piece of a search: the strip `top` to `bottom` (rows of the picture) scaled by `scale`."""

    scale: float
    top: int
    bottom: int
    megapixels: float


@dataclass
class Candidate:
    """A place where a face may be: centre and width of a Haar box."""

    x: float
    y: float
    width: float
    hits: int = 1
    misses: int = 0


class _Found(NamedTuple):
    """Centre and width of a box of the cascade, pixels of the frame."""

    x: float
    y: float
    width: float


@cache
def load_cascade() -> cv2.CascadeClassifier:
    """The cascade, which OpenCV ships. Raises RuntimeError where this build has none (5.x wheels)."""
    cascade = cv2.CascadeClassifier(f"{cv2.data.haarcascades}{FRONTAL}.xml")
    if cascade.empty():
        raise RuntimeError(f"{FRONTAL}.xml: not in this build of OpenCV ({cv2.__version__}); Deixis needs 4.x")
    return cascade


def look(grey: Image, x: float, y: float, width: float) -> Box | None:
    """The face near (x, y) that is about `width` wide, as a Haar box; None when none is seen there."""
    box = around(x, y, 1.15 * width, 1.15 * width, 1.15 * width, 1.15 * width)
    rows, columns = box.window(*grey.shape)
    part = grey[rows, columns]
    scale = LOOKED_AT_PX / width
    if min(part.shape) * scale < WINDOW_PX * 1.1:
        return None
    size = (round(part.shape[1] * scale), round(part.shape[0] * scale))
    small = cv2.resize(part, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    least, most = (round(LOOKED_AT_PX * f) for f in (0.74, 1.32))
    found = load_cascade().detectMultiScale(small, 1.07, 2, minSize=(least, least), maxSize=(most, most))
    if not len(found):
        return None
    middle = np.array([(x - columns.start) * scale, (y - rows.start) * scale])
    best = min(found, key=lambda f: float(np.hypot(f[0] + f[2] / 2 - middle[0], f[1] + f[3] / 2 - middle[1])))
    fx, fy = size[0] / part.shape[1], size[1] / part.shape[0]
    return Box(columns.start + best[0] / fx, rows.start + best[1] / fy, best[2] / fx, best[3] / fy)


def measure(frame: Image, seen: Box, turn: int) -> FrontalFace | None:
    """What `look` has seen, measured; both in pixels of the (H, W, 3) frame. None where it does not show at another size.

    One of the sizes is used in each `turn`: whoever takes the mean of three turns has that of all three.
    """
    x, y = seen.centre
    found = _find(frame, _Found(x, y, seen.w), MEASURED_AT_PX[turn % len(MEASURED_AT_PX)])
    if not found:
        return None
    box = min(found, key=lambda f: np.hypot(f.x - x, f.y - y))
    head_y = box.y - MEASURED_BOX_DROP_M / MEASURED_BOX_M * box.width
    return FrontalFace(centre_px=(box.x, head_y), width_px=FACE_WIDTH_M / MEASURED_BOX_M * box.width)


def _find(frame: Image, face: _Found, at_px: float) -> list[_Found]:
    """The face again, with its box scaled to `at_px`; none where it is not seen so."""
    side, scale = round(1.5 * face.width), at_px / face.width
    left, top = max(0, round(face.x - side / 2)), max(0, round(face.y - side / 2))
    cut = frame[top : top + side, left : left + side]
    least, most = round(0.8 * at_px), round(1.25 * at_px)
    if min(cut.shape[:2]) * scale < least:
        return []
    grey = cv2.cvtColor(cut, cv2.COLOR_BGR2GRAY)
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    boxes = load_cascade().detectMultiScale(small, 1.05, 3, minSize=(least, least), maxSize=(most, most))
    found = [_Found(left + (x + w / 2) / scale - 0.5, top + (y + h / 2) / scale - 0.5, w / scale) for x, y, w, h in boxes]
    return [again for again in found if np.hypot(again.x - face.x, again.y - face.y) < 0.2 * face.width]


def plan_jobs(height: int, width: int, config: TrackerConfig) -> list[Job]:
    """All pieces of one full search, large faces first, none larger than the budget of a frame."""
    largest = config.max_face_share * height
    size = float(config.min_face_px)
    sizes = [size]
    while size * SCALE_STEP <= largest:
        size *= SCALE_STEP
        sizes.append(size)
    jobs: list[Job] = []
    for size in reversed(sizes):
        scale = WINDOW_PX / size
        total = height * width * scale**2 / 1e6
        count = max(1, int(np.ceil(total / config.search_budget_mpx)))
        step = height / count
        for k in range(count):
            top, bottom = int(k * step), min(height, int((k + 1) * step + size))
            jobs.append(Job(scale, top, bottom, total / count))
    return jobs


class FaceSearch:
    """Searches for frontal faces piece by piece, and looks again at places where one was."""

    def __init__(self, height: int, width: int, config: TrackerConfig) -> None:
        """For working pictures of one size."""
        self._config = config
        self._jobs = plan_jobs(height, width, config)
        self._next = 0
        self.searched_all = False
        self.candidates: list[Candidate] = []

    def search(self, views: Views, tracked: int, step: Step) -> None:
        """Do the jobs of this frame; new hits become candidates. `tracked`: number of heads known."""
        if tracked and self.searched_all and not step.periods(SEARCH_S):
            return
        left = self._config.search_budget_mpx
        for _ in range(len(self._jobs)):
            job = self._jobs[self._next]
            if job.megapixels > left:
                break
            self._next = (self._next + 1) % len(self._jobs)
            self.searched_all |= self._next == 0
            left -= job.megapixels * self._run(job, views)

    def confirmed(self, views: Views, step: Step) -> list[Candidate]:
        """Look at the candidates again; those believed are returned and leave the list."""
        believed: list[Candidate] = []
        if not step.periods(LOOK_S):
            return believed
        for candidate in sorted(self.candidates, key=lambda c: -c.hits)[:2]:
            seen = look(views.grey, candidate.x, candidate.y, candidate.width)
            if seen is None:
                candidate.misses += 1
                continue
            candidate.hits += 1
            (candidate.x, candidate.y), candidate.width = seen.centre, 0.5 * (candidate.width + seen.w)
            if candidate.hits >= self._config.confirm_hits and _skin_share(views.skin, candidate) >= LEAST_SKIN:
                believed.append(candidate)
        kept = [c for c in self.candidates if c not in believed and c.misses < MISSES_ALLOWED and c.hits < MOST_LOOKS]
        self.candidates = kept[:12]
        return believed

    def _run(self, job: Job, views: Views) -> bool:
        """Do one job; false when it was skipped since there is too little skin for a face."""
        size = WINDOW_PX / job.scale
        if np.count_nonzero(views.skin[job.top // 2 : job.bottom // 2 : 2, ::2] > 60) * 16 < 0.2 * size * size:
            return False
        strip = views.grey[job.top : job.bottom]
        small = cv2.resize(strip, None, fx=job.scale, fy=job.scale, interpolation=cv2.INTER_AREA)
        window = (WINDOW_PX, WINDOW_PX)
        # One hit of the cascade is enough: steps between the scales are wide, and each candidate is looked at again.
        for x, y, w, h in load_cascade().detectMultiScale(small, 1.1, 0, minSize=window, maxSize=window):
            self._add((x + w / 2) / job.scale, job.top + (y + h / 2) / job.scale, w / job.scale)
        return True

    def _add(self, x: float, y: float, width: float) -> None:
        for known in self.candidates:
            if abs(known.x - x) < 0.4 * width and abs(known.y - y) < 0.4 * width and 0.6 < known.width / width < 1.6:
                return
        self.candidates.append(Candidate(x, y, width))


def _skin_share(skin: Image, candidate: Candidate) -> float:
    """Mean P(skin), of a coarse map, in the middle of a face, 0 to 1."""
    half = 0.3 * candidate.width
    rows, columns = around(candidate.x, candidate.y, half, half, half, half).scaled(COARSE).window(*skin.shape)
    return float(skin[rows, columns].mean()) / 255 if skin[rows, columns].size else 0.0
