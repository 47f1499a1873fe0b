"""Chooses what counts as somebody's sway: `SLIGHT` and `CLEAR` of `deixis_tracker/sway.py`, `SURE_ODDS` of `head_search.py`.

usage: python fitting/choose_sway.py [--seeds A:B]

In clips whose camera stands, true heads and the room's exhibits (which stand like people, and some are busts) are looked at
in pictures .3 s apart: how often are they said to sway, by each limit? Exhibits nearer to somebody than an arm reaches are
told apart, for people pass before them. Then: how sure is the finder of true heads, and of what else it takes for a head?
It takes a minute, and half a minute to render each clip that is not there.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np
from deixis_evaluation.chosen_clips import Choice, choose
from deixis_evaluation.clips import Clip, TrueFrame, Truth
from deixis_evaluation.replay import Given
from deixis_schemas.anatomy import FACE_WIDTH_M, HEAD_WIDTH_M
from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import Finder, apart, whole_looks
from deixis_tracker.frame import Image
from deixis_tracker.head_search import ABOUT, LEAST_ODDS, SURE_ODDS
from deixis_tracker.sway import Glimpse, Sway
from rich.console import Console

TRIED = tuple(Sway(px, explained) for px in (0.08, 0.1, 0.12, 0.35) for explained in (0.1, 0.2, 0.3))
APART_S, EVERY_S, ODDS_EVERY_S = 0.3, 0.5, 1.0
WIDTHS_PX = 10.0, 100.0
KINDS = ("heads", "exhibits", "exhibits near people")
Place = tuple[float, float, float]
"""x, y and the width of a head there, pixels of the working picture."""


@dataclass
class Found:
    """Of each kind: which of TRIED call it a sway, look by look; and odds of what the finder takes for heads, true or not."""

    sways: dict[str, list[list[bool]]] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    odds: dict[bool, list[float]] = field(default_factory=lambda: {True: [], False: []})


def main() -> int:
    """Play, count, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1000:1028")
    given = parser.parse_args()
    cv2.setNumThreads(1)
    found, finder = Found(), Finder()
    for clip in choose(Choice(None, given.seeds), Console(stderr=True)).clips:
        if not clip.truth.moves:
            look_at(clip, finder, found)
    print("pixels  explained  " + "  ".join(f"{kind} ({len(found.sways[kind])})" for kind in KINDS))
    for number, sway in enumerate(TRIED):
        shares = (_share([said[number] for said in found.sways[kind]]) for kind in KINDS)
        print(f"{sway.least_px:6.2f}  {sway.least_explained:9.1f}  " + "  ".join(f"{share:6.1%}" for share in shares))
    for is_head, odds in found.odds.items():
        sure = _share([odd >= SURE_ODDS for odd in odds])
        print(f"{'heads' if is_head else 'other places'} that the finder takes for heads: {sure:.0%} of {len(odds)} surely")
    return 0


def _share(said: list[bool]) -> float:
    return sum(said) / len(said) if said else math.nan


def look_at(clip: Clip, finder: Finder, found: Found) -> None:
    """Go through a clip."""
    pictures = list(_working_pictures(clip))
    rate_hz, truth = clip.truth.meta.fps, clip.truth
    scale = pictures[0].shape[1] / truth.meta.width
    exhibits = [place for place in _exhibits(truth, scale) if WIDTHS_PX[0] <= place[2] <= WIDTHS_PX[1]]
    later = round(APART_S * rate_hz)
    for k in range(0, len(pictures) - later, round(EVERY_S * rate_hz)):
        heads = _heads(truth, truth.frames[k], scale)
        for kind, places in (("heads", heads), *_by_nearness(exhibits, heads).items()):
            for place in places:
                glimpse = Glimpse.of(pictures[k], *place, 0)
                if glimpse is not None:
                    said = [glimpse.sways(pictures[k + later], round(APART_S * 1e9), sway) for sway in TRIED]
                    found.sways[kind].append(said)
    for k in range(0, len(pictures), round(ODDS_EVERY_S * rate_hz)):
        heads = _heads(truth, truth.frames[k], scale)
        for odds, x, y in _taken_for_heads(finder, pictures[k]):
            found.odds[any(math.hypot(x - at[0], y - at[1]) < at[2] for at in heads)].append(odds)


def _working_pictures(clip: Clip) -> Iterator[Image]:
    for _, picture in Given(clip).pictures():
        scale = min(1.0, TrackerConfig().work_width_px / max(picture.shape[:2]))
        small = picture if scale == 1 else cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        yield np.asarray(small, np.uint8)


def _heads(truth: Truth, frame: TrueFrame, scale: float) -> list[Place]:
    wide = scale * HEAD_WIDTH_M / FACE_WIDTH_M
    return [
        (scale * person.head.center_px[0], scale * person.head.center_px[1], wide * truth.face_width_px(person))
        for person in frame.persons
    ]


def _exhibits(truth: Truth, scale: float) -> Iterator[Place]:
    """Where they are in the picture, and how wide a head would be there."""
    camera = truth.meta.camera
    for poi in truth.meta.pois:
        right, down, ahead = camera.rotation @ (np.array(poi.xyz_world) - camera.centre)
        if ahead > 0:
            (fx, _, cx), (_, fy, cy) = camera.K[0], camera.K[1]
            x, y = cx + fx * right / ahead, cy + fy * down / ahead
            if truth.in_picture((x, y)):
                yield scale * x, scale * y, scale * fx * HEAD_WIDTH_M / ahead


def _by_nearness(exhibits: list[Place], heads: list[Place]) -> dict[str, list[Place]]:
    of_kind: dict[str, list[Place]] = {"exhibits": [], "exhibits near people": []}
    for x, y, width in exhibits:
        near = any(math.hypot(x - at[0], y - at[1]) < ABOUT * at[2] for at in heads)
        of_kind["exhibits near people" if near else "exhibits"].append((x, y, width))
    return of_kind


def _taken_for_heads(finder: Finder, picture: Image) -> Iterator[tuple[float, float, float]]:
    """Log odds and place, as the search looks at them again."""
    height, width = picture.shape[:2]
    for look in whole_looks(height, width):
        for seen in apart(finder.over(picture, look).heads(LEAST_ODDS)):
            again = finder.around(picture, seen.x, seen.y, seen.width).heads(-1.0)
            near = [head for head in again if math.hypot(head.x - seen.x, head.y - seen.y) < 0.5 * seen.width]
            if near:
                yield near[0].odds, seen.x, seen.y


if __name__ == "__main__":
    raise SystemExit(main())
