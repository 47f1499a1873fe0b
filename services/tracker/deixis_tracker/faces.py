"""Finds faces with Haar cascades (Viola and Jones 2001) within a bounded share of each frame's time.

A full search of a VGA picture takes about 100 ms, so it is cut into jobs (one scale, one strip of the picture) and each
frame does a few. Hits become candidates which are looked at again in the next frames, in their neighbourhood only; single
hits land on shirts and furniture, so a face is believed after several hits in separate frames, with skin in its middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import cv2
import cv2.data
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.boxes import Box, around
from deixis_tracker.coarse import COARSE
from deixis_tracker.config import TrackerConfig

Image = NDArray[np.uint8]

FRONTAL = "haarcascade_frontalface_alt2"
WINDOW_PX = 20  # of that cascade
SCALE_STEP = 1.17
VERIFY_PX = 32  # a face that is looked at again is scaled to this width
MISSES_ALLOWED = 3
LEAST_SKIN = 0.12
SEARCH_EVERY_WITH_FACE = 3  # frames, once somebody is tracked


class Job(NamedTuple):
    """One piece of a search: the strip `top` to `bottom` (rows of the picture) scaled by `scale`."""

    scale: float
    top: int
    bottom: int
    megapixels: float


@dataclass
class Candidate:
    """A place where a face may be."""

    x: float
    y: float
    width: float
    hits: int = 1
    misses: int = 0
    skin: float = 0.0


@cache
def load_cascade(name: str) -> cv2.CascadeClassifier:
    """A cascade that OpenCV ships. Raises RuntimeError where this build has none (5.x wheels)."""
    cascade = cv2.CascadeClassifier(f"{cv2.data.haarcascades}{name}.xml")
    if cascade.empty():
        raise RuntimeError(f"{name}.xml: not in this build of OpenCV ({cv2.__version__}); Deixis needs 4.x")
    return cascade


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


class FaceDetector:
    """Searches for frontal faces piece by piece, and looks again at places where one was."""

    def __init__(self, height: int, width: int, config: TrackerConfig) -> None:
        """For pictures of one size."""
        self._frontal = load_cascade(FRONTAL)
        self._config = config
        self._jobs = plan_jobs(height, width, config)
        self._next = 0
        self._frame = 0
        self.searched_all = False
        self.candidates: list[Candidate] = []

    def search(self, grey: Image, skin: Image, tracked: int) -> None:
        """Do the jobs of this frame; new hits become candidates. `skin`: coarse P(skin); `tracked`: number of faces known."""
        self._frame += 1
        if tracked and self.searched_all and self._frame % SEARCH_EVERY_WITH_FACE:
            return
        left = self._config.search_budget_mpx
        for _ in range(len(self._jobs)):
            job = self._jobs[self._next]
            if job.megapixels > left:
                break
            self._next = (self._next + 1) % len(self._jobs)
            self.searched_all |= self._next == 0
            left -= job.megapixels * self._run(job, grey, skin)

    def look_again(self, grey: Image, x: float, y: float, width: float) -> Box | None:
        """The face near (x, y) that is about `width` wide, as a Haar box; None when none is seen there."""
        box = around(x, y, 1.15 * width, 1.15 * width, 1.15 * width, 1.15 * width)
        rows, columns = box.window(*grey.shape)
        part = grey[rows, columns]
        scale = VERIFY_PX / width
        if min(part.shape) * scale < WINDOW_PX * 1.1:
            return None
        size = (round(part.shape[1] * scale), round(part.shape[0] * scale))
        small = cv2.resize(part, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
        least, most = (round(VERIFY_PX * f) for f in (0.74, 1.32))
        found = self._frontal.detectMultiScale(small, 1.07, 2, minSize=(least, least), maxSize=(most, most))
        if not len(found):
            return None
        middle = np.array([(x - columns.start) * scale, (y - rows.start) * scale])
        best = min(found, key=lambda f: float(np.hypot(f[0] + f[2] / 2 - middle[0], f[1] + f[3] / 2 - middle[1])))
        fx, fy = size[0] / part.shape[1], size[1] / part.shape[0]
        return Box(columns.start + best[0] / fx, rows.start + best[1] / fy, best[2] / fx, best[3] / fy)

    def confirmed(self, grey: Image, skin: Image) -> list[Candidate]:
        """Look at the candidates again; those believed are returned and leave the list."""
        believed = []
        for candidate in sorted(self.candidates, key=lambda c: -c.hits)[:2]:
            seen = self.look_again(grey, candidate.x, candidate.y, candidate.width)
            if seen is None:
                candidate.misses += 1
                continue
            candidate.hits += 1
            (candidate.x, candidate.y), candidate.width = seen.centre, 0.5 * (candidate.width + seen.w)
            candidate.skin = skin_share(skin, candidate)
            if candidate.hits >= self._config.confirm_hits and candidate.skin >= LEAST_SKIN:
                believed.append(candidate)
        self.candidates = [c for c in self.candidates if c not in believed and c.misses < MISSES_ALLOWED and c.hits < 30][:12]
        return believed

    def _run(self, job: Job, grey: Image, skin: Image) -> bool:
        """Do one job; false when it was skipped since there is too little skin for a face."""
        size = WINDOW_PX / job.scale
        if np.count_nonzero(skin[job.top // 2 : job.bottom // 2 : 2, ::2] > 60) * 16 < 0.2 * size * size:
            return False
        strip = grey[job.top : job.bottom]
        small = cv2.resize(strip, None, fx=job.scale, fy=job.scale, interpolation=cv2.INTER_AREA)
        window = (WINDOW_PX, WINDOW_PX)
        # One hit of the cascade is enough: steps between the scales are wide, and each candidate is looked at again.
        for x, y, w, h in self._frontal.detectMultiScale(small, 1.1, 0, minSize=window, maxSize=window):
            self._add((x + w / 2) / job.scale, job.top + (y + h / 2) / job.scale, w / job.scale)
        return True

    def _add(self, x: float, y: float, width: float) -> None:
        for known in self.candidates:
            if abs(known.x - x) < 0.4 * width and abs(known.y - y) < 0.4 * width and 0.6 < known.width / width < 1.6:
                return
        self.candidates.append(Candidate(x, y, width))


def skin_share(skin: Image, candidate: Candidate) -> float:
    """Mean P(skin), of a coarse map, in the middle of a face, 0 to 1."""
    half = 0.3 * candidate.width
    rows, columns = around(candidate.x, candidate.y, half, half, half, half).scaled(COARSE).window(*skin.shape)
    return float(skin[rows, columns].mean()) / 255 if skin[rows, columns].size else 0.0
