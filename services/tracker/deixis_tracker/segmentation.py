"""Which pixels may be hands: skin-coloured, and either changed against the room or where the room is not known."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from deixis_tracker.background import Background, MotionHistory
from deixis_tracker.config import TrackerConfig
from deixis_tracker.frame import COARSE, Image, Mask, Views, around
from deixis_tracker.persons import Person
from deixis_tracker.skin import SkinModel, hysteresis

MOST_BLOBS = 24
FACE_RIM, SLIVER = 0.22, 0.6  # a region with that share so near a head is the rim of a turned face
GHOST, GHOST_EDGE = 0.6, 12.0  # edges of a ghost: share of those remembered, and grey levels these have at least
EDGE = np.ones((3, 3), np.uint8)


class Blob(NamedTuple):
    """One connected region in a window whose corner is at (x0, y0), working resolution; `mask` is 0 or 1."""

    mask: Mask
    x0: int
    y0: int
    area: int
    evidence: float  # share that changed against the room or moved lately
    sure: float  # mean P(skin)
    owner: int | None = None  # person_id of whose hand it is, where that is known


def head_zone(shape: tuple[int, int], persons: list[Person], rim: float) -> Mask:
    """255 on heads and necks and `rim` head widths around heads, at coarse resolution: skin there is no hand."""
    zone = np.zeros(shape, np.uint8)
    for person in persons:
        x, y, w = COARSE * person.x, COARSE * person.y, COARSE * person.width
        cv2.ellipse(zone, (round(x), round(y)), (round((0.6 + rim) * w), round((0.8 + rim) * w)), 0, 0, 360, 255, -1)
        cv2.rectangle(zone, (round(x - 0.42 * w), round(y)), (round(x + 0.42 * w), round(y + 1.25 * w)), 255, -1)
    return zone


def hand_blobs(
    views: Views,
    skin_model: SkinModel,
    background: Background,
    motion: MotionHistory,
    persons: list[Person],
    config: TrackerConfig,
) -> list[Blob]:
    """Skin-coloured regions that may be hands of the persons, largest first; found coarsely, their edges refined."""
    skin = views.skin
    candidates = cv2.bitwise_and(cv2.inRange(skin, config.skin_low, 255), views.changed)
    foreground = background.remove_shadow(views.coarse, np.asarray(candidates, np.uint8))
    # Where the room is not known only the colour speaks, so it has to be sure: trousers, shirts and wood floors are
    # nearly skin.
    certain = cv2.bitwise_and(background.unknown, cv2.inRange(skin, config.skin_high, 255))
    allowed = cv2.bitwise_or(foreground, np.asarray(certain, np.uint8))
    heads = head_zone((skin.shape[0], skin.shape[1]), persons, 0.0)
    near_head = head_zone((skin.shape[0], skin.shape[1]), persons, FACE_RIM)
    probability = np.asarray(cv2.bitwise_and(skin, cv2.subtract(allowed, heads)), np.uint8)
    least = 0.8 * config.min_hand_area * min(p.width for p in persons) ** 2 * COARSE**2
    labels, stats, kept = hysteresis(probability, config.skin_low, config.skin_high, max(4, int(least)))
    blobs = []
    for k in sorted(kept, key=lambda k: -int(stats[k, cv2.CC_STAT_AREA]))[:MOST_BLOBS]:
        x, y, w, h = (int(v) for v in stats[k, :4])
        mask = np.asarray(labels[y : y + h, x : x + w] == k, np.uint8)
        window = np.s_[y : y + h, x : x + w]
        if cv2.mean(near_head[window], mask)[0] > SLIVER * 255 or _is_ghost(mask, x, y, views.coarse, background.room):
            continue
        evidence = _evidence(mask, x, y, foreground, motion)
        sure = cv2.mean(skin[window], mask)[0] / 255
        blob = _refined(mask, x, y, evidence, sure, views.full, skin_model, config.skin_low)
        if blob.area:  # a thin region may be gone at full resolution, and a hand cut from nothing cost all tracks of the frame
            blobs.append(blob)
    return blobs


def _refined(mask: Mask, x: int, y: int, evidence: float, sure: float, image: Image, skin_model: SkinModel, low: int) -> Blob:
    """A coarse region at full resolution: what surely lies inside stays, pixels about its edge are judged one by one."""
    padded = cv2.copyMakeBorder(mask, 1, 1, 1, 1, cv2.BORDER_CONSTANT)
    inside = cv2.resize(cv2.erode(padded, EDGE, borderValue=0), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
    reach = cv2.resize(cv2.dilate(padded, EDGE), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
    x0, y0 = max(0, 2 * (x - 1)), max(0, 2 * (y - 1))
    left, top = x0 - 2 * (x - 1), y0 - 2 * (y - 1)
    part = image[y0 : 2 * (y - 1) + reach.shape[0], x0 : 2 * (x - 1) + reach.shape[1]]
    window = np.s_[top : top + part.shape[0], left : left + part.shape[1]]
    skin = np.asarray(skin_model.probability(part) >= low, np.uint8)
    fine = np.asarray(cv2.medianBlur(cv2.bitwise_or(inside[window], cv2.bitwise_and(reach[window], skin)), 3), np.uint8)
    return Blob(fine, x0, y0, int(np.count_nonzero(fine)), evidence, sure)


def _is_ghost(mask: Mask, x: int, y: int, coarse: Image, room: Image) -> bool:
    """Whether a region's outline is seen in the remembered room and not in the picture: something has left that place."""
    h, w = mask.shape
    x0, y0 = max(0, x - 1), max(0, y - 1)
    window = np.s_[y0 : y + h + 1, x0 : x + w + 1]
    padded = np.zeros(room[window].shape[:2], np.uint8)
    padded[y - y0 : y - y0 + h, x - x0 : x - x0 + w] = mask
    rim = np.asarray(cv2.morphologyEx(padded, cv2.MORPH_GRADIENT, EDGE), np.uint8)
    known = _edges(room[window], rim)
    return known > GHOST_EDGE and _edges(coarse[window], rim) < GHOST * known


def _edges(part: Image, rim: Mask) -> float:
    """How much the grey levels of a picture (h, w, 3) change, in the mean over a rim."""
    grey = cv2.cvtColor(part, cv2.COLOR_BGR2GRAY)
    return float(cv2.mean(cv2.morphologyEx(grey, cv2.MORPH_GRADIENT, EDGE), rim)[0])


def _evidence(mask: Mask, x: int, y: int, foreground: Mask, motion: MotionHistory) -> float:
    """How much of a coarse region changed against the room or moved lately, 0 to 1."""
    h, w = mask.shape
    changed = cv2.mean(foreground[y : y + h, x : x + w], mask)[0] / 255
    box = around(x + w / 2, y + h / 2, w / 2 + 2, h / 2 + 2, w / 2 + 2, h / 2 + 2).scaled(0.5)
    rows, columns = box.window(*motion.history.shape)
    part = motion.history[rows, columns]
    moved = float(np.count_nonzero(part)) / max(1, part.size)
    return min(1.0, max(changed, 2.5 * moved))
