"""Hands of real and of rendered people: how much skin is told from the rest, and whether a single finger is seen as one.

Skin is judged by the prior alone, for pictures of hands hold no face to adapt to. Fingers are counted on the true outline of
the hand where there is one (hgr1, rendered clips), else on what differs from the colours around the labelled box (hands).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar
from xml.etree import ElementTree

import cv2
import numpy as np
from deixis_evaluation.clips import Clip, TruePerson
from deixis_evaluation.replay import Picture
from deixis_evaluation.true_tracks import PART_BITS, PARTS, PERSON_SHIFT, LabelPictures, label_pictures_of
from deixis_gesture.fingertips import find_fingers
from deixis_gesture.hand import hand_of
from deixis_gesture.rules import POINTING_FINGER
from deixis_tracker.config import TrackerConfig
from deixis_tracker.skin import SkinModel
from numpy.typing import NDArray
from real_heads import pictures_of

Mask = NDArray[np.uint8]
T = TypeVar("T")

# No face gives the scale of a lone hand: fists and palms are about so wide (radius, face widths; see deixis_gesture.bearing).
PALM_RADIUS = 0.25
# A lone hand stands upright above the chest.
RAISED = (0.0, -1.5)
HGR_INDEX_ALONE = ("Z", "D")
"""Signs of hgr1 that extend the index finger alone. All others count as other hands: of the digits 2 to 5 alone, as it was
counted once, none is taken for an index; of all signs a third are."""
CUT_ROUNDS, CUT_MARGIN, CUT_SIDE_PX = 4, 0.4, 160
"""A boxed hand is cut out (GrabCut) in so many rounds, with so much around its box, sides, in a picture of so many pixels."""
OPEN_HANDS = ("wave", "stop")
EVERY = 10
"""Of a rendered clip every so many frames are looked at."""
SKIN_PARTS = range(1, 7)


@dataclass
class Hands:
    """Pixel counts of skin and background, and pictures with one finger extended or another number of them."""

    pictures: int = 0
    skin: int = 0
    skin_found: int = 0
    background: int = 0
    background_taken: int = 0
    single: int = 0
    single_seen: int = 0
    others: int = 0
    others_as_single: int = 0

    def count_skin(self, called: NDArray[np.bool_], skin: NDArray[np.bool_], background: NDArray[np.bool_]) -> None:
        """One picture (h, w): what was called skin, what is skin, and what surely is not."""
        self.skin += int(skin.sum())
        self.skin_found += int((called & skin).sum())
        self.background += int(background.sum())
        self.background_taken += int((called & background).sum())

    def count_fingers(self, *, alone: bool, found: int) -> None:
        """One hand, whether it extends the index finger alone, and how many fingers were found."""
        if alone:
            self.single += 1
            self.single_seen += found == 1
        else:
            self.others += 1
            self.others_as_single += found == 1

    def figures(self) -> dict[str, float | None]:
        """The columns of the table."""
        return {
            "pictures": float(self.pictures),
            "skin_found_share": _share(self.skin_found, self.skin),
            "background_as_skin_share": _share(self.background_taken, self.background),
            "one_finger": float(self.single),
            "one_finger_seen_share": _share(self.single_seen, self.single),
            "other_hands": float(self.others),
            "others_seen_as_one_finger_share": _share(self.others_as_single, self.others),
            "one_finger_precision": _share(self.single_seen, self.single_seen + self.others_as_single),
        }


def hgr1(folder: Path, sample: int) -> Hands:
    """Hands with skin masks, at most `sample` of them."""
    hands = Hands()
    for path in sampled(sorted(folder.glob("*.mask.png")), sample):
        picture, truth = cv2.imread(str(path).replace(".mask.png", ".jpg")), cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        if picture is None or truth is None or truth.shape != picture.shape[:2]:
            raise ValueError(f"'{path}' and its picture do not belong together")
        hands.pictures += 1
        hands.count_skin(called_skin(np.asarray(picture, np.uint8)), truth > 127, truth <= 127)
        alone = path.name.split("_", 1)[0] in HGR_INDEX_ALONE
        hands.count_fingers(alone=alone, found=fingers_of(np.asarray(truth > 127, np.uint8), RAISED))
    return hands


def boxed(folder: Path, sample: int) -> Hands:
    """Hands with boxes and the number of their fingers, at most `sample` pictures."""
    hands = Hands()
    for path in sampled(sorted(folder.glob("*.xml")), sample):
        picture = cv2.imread(str(path.with_suffix(".jpg")))
        if picture is None:
            raise ValueError(f"'{path}' has no picture")
        hands.pictures += 1
        for extended, box in _boxes(path):
            found = fingers_of(cut_out(np.asarray(picture, np.uint8), box), RAISED)
            hands.count_fingers(alone=extended == 1, found=found)
    return hands


def cut_out(picture: Picture, box: tuple[int, int, int, int]) -> Mask:
    """What stands out in a box (left, top, right, bottom) against the colours around it, 0 or 1.

    The skin prior alone left wall and door in the box, and so judged the finding of fingers on what no hand is.
    """
    (x0, y0, x1, y1), (height, width) = box, picture.shape[:2]
    margin = round(CUT_MARGIN * max(x1 - x0, y1 - y0))
    left, top = max(0, x0 - margin), max(0, y0 - margin)
    around = picture[top : min(height, y1 + margin), left : min(width, x1 + margin)]
    share = min(1.0, CUT_SIDE_PX / max(around.shape[:2]))
    small = np.asarray(cv2.resize(around, None, fx=share, fy=share, interpolation=cv2.INTER_AREA), np.uint8)
    mask = np.full(small.shape[:2], cv2.GC_BGD, np.uint8)
    inside = tuple(slice(round((a - o) * share), round((b - o) * share)) for a, b, o in ((y0, y1, top), (x0, x1, left)))
    mask[inside] = cv2.GC_PR_FGD
    if (mask == cv2.GC_BGD).sum() < 2 or (mask == cv2.GC_PR_FGD).sum() < 2:
        return np.zeros(small.shape[:2], np.uint8)
    cv2.setRNGSeed(0)  # GrabCut draws its first clusters by chance
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(small, mask, (0, 0, 0, 0), *models, CUT_ROUNDS, cv2.GC_INIT_WITH_MASK)
    return np.asarray((mask == cv2.GC_FGD) | (mask == cv2.GC_PR_FGD), np.uint8)


def rendered(clips: Sequence[Clip]) -> Hands:
    """Hands of rendered people, of clips with label pictures: pointing ones, and open ones."""
    hands = Hands()
    for clip in clips:
        labels = LabelPictures(label_pictures_of(clip))
        for frame, picture in zip(clip.truth.frames, pictures_of(clip.video), strict=False):
            parts = labels.at(frame.frame) if frame.frame % EVERY == 0 else None
            if parts is None:
                continue
            hands.pictures += 1
            _count_rendered(hands, picture, parts, frame.persons)
    return hands


def _count_rendered(hands: Hands, picture: Picture, parts: Mask, persons: Sequence[TruePerson]) -> None:
    part = parts & PART_BITS
    hands.count_skin(called_skin(picture), np.isin(part, list(PARTS.values())), ~np.isin(part, list(SKIN_PARTS)))
    for person in persons:
        side = person.raised
        if side is None or not (person.points or person.gesture in OPEN_HANDS):
            continue
        own = np.asarray((part == PARTS[side]) & (parts >> PERSON_SHIFT == person.id), np.uint8)
        if own.any():
            hands.count_fingers(alone=person.points, found=fingers_of(own, _place(person, own)))


def sampled(items: Sequence[T], sample: int) -> list[T]:
    """At most `sample` of the items, spread evenly."""
    count = min(len(items), sample)
    return [items[number * len(items) // count] for number in range(count)]


def called_skin(picture: Picture) -> NDArray[np.bool_]:
    """What the prior calls skin in a picture (h, w, 3), BGR."""
    config = TrackerConfig()
    return np.asarray(SkinModel(config.prior_skin).probability(picture) >= config.skin_low, np.bool_)


def fingers_of(mask: Mask, place: tuple[float, float]) -> int:
    """Pointing fingers on the largest piece of a mask (h, w); `place` of its middle about the face, face widths."""
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not outlines:
        return 0
    outline = max(outlines, key=cv2.contourArea)[:, 0, :].astype(np.float32)
    filled = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), np.uint8)
    cv2.fillPoly(filled, [outline.astype(np.int32) + 1], (1,))
    radius = float(cv2.distanceTransform(filled, cv2.DIST_L2, 3).max())
    if radius < 1:
        return 0
    scaled = (outline - outline.mean(axis=0)) * (PALM_RADIUS / radius) + np.array(place, np.float32)
    hand = hand_of(np.asarray(scaled, np.float32))
    return 0 if hand is None else sum(finger.length >= POINTING_FINGER for finger in find_fingers(hand))


def _place(person: TruePerson, mask: Mask) -> tuple[float, float]:
    """Middle of the hand about the head's centre, in palms as lone hands are measured."""
    rows, columns = np.nonzero(mask)
    radius = max(1.0, float(cv2.distanceTransform(np.pad(mask, 1), cv2.DIST_L2, 3).max()))
    scale = PALM_RADIUS / radius
    x, y = person.head.center_px
    return float(columns.mean() - x) * scale, float(rows.mean() - y) * scale


def _boxes(path: Path) -> Iterator[tuple[int, tuple[int, int, int, int]]]:
    """Fingers extended and box (left, top, right, bottom) of each hand in a VOC file."""
    for item in ElementTree.parse(path).getroot().iter("object"):
        named = re.fullmatch(r"([0-5])-hand", item.findtext("name", ""))
        box = [int(float(item.findtext(f"bndbox/{side}", "0"))) for side in ("xmin", "ymin", "xmax", "ymax")]
        if named and box[2] > box[0] and box[3] > box[1]:
            yield int(named[1]), (max(0, box[0]), max(0, box[1]), box[2], box[3])


def _share(count: int, total: int) -> float | None:
    return count / total if total else None
