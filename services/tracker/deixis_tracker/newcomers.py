"""Finds people who are not tracked yet: by a face from the front, or by the head of a silhouette that walks past.

A full search for faces in a VGA picture takes about 100 ms, so it is cut into jobs (one scale, one strip of the picture) and
each frame does a few. Hits become candidates which are looked at again in the next frames, in their neighbourhood only;
single hits land on shirts and furniture, so a face is believed after several hits in separate frames, with skin in its
middle.

Somebody who comes into an empty room differs from it from head to foot, so the head is the top of the changed region; skin
in it tells a person from a door that opens.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from deixis_tracker.config import TrackerConfig
from deixis_tracker.faces import WINDOW_PX, load_cascade, look
from deixis_tracker.seconds import Step
from deixis_tracker.views import COARSE, Image, Mask, Views, around

SCALE_STEP = 1.17
MISSES_ALLOWED, MOST_LOOKS = 3, 30  # looks, not frames: each is one more witness, however many there are in a second
LOOK_S = 1 / 30
LEAST_SKIN = 0.12
SEARCH_S = 0.1  # once somebody is tracked

SHRINK = 2  # of the coarse masks
LEAST_HEIGHT_PX = 45
LEAST_SLENDERNESS = 1.5  # height over width
SKIN = 60
WALKER_S = 0.13  # a silhouette's head is believed when it was seen in all frames for so long
WALKER_LEAP, WALKER_SPEED = 0.3, 9.0  # between two frames: head widths, and head widths per second


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


class WalkerHead(NamedTuple):
    """Centre of a silhouette's head and the width of a head from the front, pixels; since when it was seen."""

    x: float
    y: float
    width: float
    since_ns: int = 0


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


class Walkers:
    """Heads of silhouettes, believed when seen for a while, each near where it was in the frame before."""

    def __init__(self) -> None:
        self._last: list[WalkerHead] = []

    def believed(self, seen: list[WalkerHead], step: Step) -> list[WalkerHead]:
        """Of the heads seen in this frame, those believed."""
        self._last = [head._replace(since_ns=self._since(head, step)) for head in seen]
        return [head for head in self._last if step.now_ns - head.since_ns >= WALKER_S * 1e9]

    def _since(self, head: WalkerHead, step: Step) -> int:
        reach = (WALKER_LEAP + WALKER_SPEED * step.passed_s) * head.width
        before = [w.since_ns for w in self._last if abs(w.x - head.x) < reach and abs(w.y - head.y) < 0.5 * head.width]
        return min(before, default=step.now_ns)


def silhouette_heads(changed: Mask, skin: Image, people: Mask) -> list[WalkerHead]:
    """Heads on top of changed regions, in pixels of the working picture, outside of `people` (255 where somebody is tracked).

    All pictures are coarse.
    """
    size = (changed.shape[1] // SHRINK, changed.shape[0] // SHRINK)
    small = cv2.resize(cv2.bitwise_and(changed, cv2.bitwise_not(people)), size, interpolation=cv2.INTER_AREA)
    solid = cv2.morphologyEx(np.asarray(small > 100, np.uint8), cv2.MORPH_CLOSE, np.ones((5, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(solid, connectivity=8)
    heads = []
    for k in range(1, count):
        x, y, w, h, area = (int(v) for v in stats[k])
        if h * SHRINK < LEAST_HEIGHT_PX or h < LEAST_SLENDERNESS * w or area < 0.25 * w * h or x == 0 or x + w == size[0]:
            continue
        head = _top_of(np.asarray(labels[y : y + h, x : x + w] == k, np.uint8), x, y)
        if head is not None and _has_skin(head, skin):
            heads.append(WalkerHead(head.x / COARSE, head.y / COARSE, head.width / COARSE))
    return heads


def _top_of(mask: Mask, x0: int, y0: int) -> WalkerHead | None:
    """The head on top of one silhouette, in pixels of the coarse picture: rows from the top until the shoulders widen."""
    rows = mask.sum(axis=1)
    longest = max(3, len(rows) // 6)
    width = float(np.median(rows[: max(2, longest * 2 // 3)]))
    shoulders = float(np.median(rows[longest + 1 : 2 * longest + 2]))
    if width < 3 or shoulders < 1.15 * width:
        return None
    columns = np.nonzero(mask[: round(1.3 * width)])[1]
    # A head in profile is about 1.25 of its widths deep.
    head = width * SHRINK / 1.25
    return WalkerHead((x0 + float(columns.mean()) + 0.5) * SHRINK, y0 * SHRINK + 0.68 * head, head)


def _has_skin(head: WalkerHead, skin: Image) -> bool:
    half = 0.6 * head.width
    top, left = max(0, int(head.y - half)), max(0, int(head.x - half))
    part = skin[top : int(head.y + half), left : int(head.x + half)]
    return part.size > 0 and float(np.count_nonzero(part > SKIN)) / part.size > 0.15
