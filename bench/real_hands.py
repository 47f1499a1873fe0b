"""Hands of real and of rendered people: how much skin is told from the rest, whether a single finger is seen as one, and
whether an index finger alone is called that.

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
from deixis_gesture.hand import CHEST, HandShape, hand_of
from deixis_gesture.hand_posture import posture_of
from deixis_gesture.rules import POINTING_FINGER
from deixis_schemas.anatomy import FACE_WIDTH_M, HEAD_WIDTH_M
from deixis_tracker.config import TrackerConfig
from deixis_tracker.hands import cut_hand
from deixis_tracker.skin import SkinModel
from numpy.typing import NDArray
from real_heads import pictures_of

Mask = NDArray[np.uint8]
T = TypeVar("T")

# No face gives the scale of a lone hand: fists and palms are about so wide (radius, face widths; see deixis_gesture.bearing).
PALM_RADIUS = 0.25
# An arm's length from the chest to the palm: how far out does not matter for the outline. A boxed hand stands upright.
REACH = 3.0
RAISED = (CHEST[0], CHEST[1] - REACH)
BORDER_PX = 2
HGR_INDEX_ALONE = ("Z", "D")
"""Signs of hgr1 that extend the index finger alone. All others count as other hands: of the digits 2 to 5 alone, as it was
counted once, none is taken for an index; of all signs a third are. One of them is I, the little finger alone: its outline is
that of an index finger of the other hand, or from the other side."""
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
    single_named: int = 0
    others_named_single: int = 0
    unknown: int = 0

    def count_skin(self, called: NDArray[np.bool_], skin: NDArray[np.bool_], background: NDArray[np.bool_]) -> None:
        """One picture (h, w): what was called skin, what is skin, and what surely is not."""
        self.skin += int(skin.sum())
        self.skin_found += int((called & skin).sum())
        self.background += int(background.sum())
        self.background_taken += int((called & background).sum())

    def count_hand(self, hand: HandShape | None, *, alone: bool) -> None:
        """One hand, and whether it extends the index finger alone: how many fingers stand out, and what it is called."""
        found, posture = fingers_of(hand), "unknown" if hand is None else posture_of(hand).named
        self.unknown += posture == "unknown"
        if alone:
            self.single += 1
            self.single_seen += found == 1
            self.single_named += posture == "index"
        else:
            self.others += 1
            self.others_as_single += found == 1
            self.others_named_single += posture == "index"

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
            "index_named_share": _share(self.single_named, self.single),
            "index_named_precision": _share(self.single_named, self.single_named + self.others_named_single),
            "posture_unknown_share": _share(self.unknown, self.single + self.others),
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
        hands.count_hand(lone_hand(np.asarray(truth > 127, np.uint8)), alone=alone)
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
            hands.count_hand(hand_on(cut_out(np.asarray(picture, np.uint8), box), RAISED), alone=extended == 1)
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
            hands.count_hand(hand_on(own, _place(person, own)), alone=person.points)


def sampled(items: Sequence[T], sample: int) -> list[T]:
    """At most `sample` of the items, spread evenly."""
    count = min(len(items), sample)
    return [items[number * len(items) // count] for number in range(count)]


def called_skin(picture: Picture) -> NDArray[np.bool_]:
    """What the prior calls skin in a picture (h, w, 3), BGR."""
    config = TrackerConfig()
    return np.asarray(SkinModel(config.prior_skin).probability(picture) >= config.skin_low, np.bool_)


def fingers_of(hand: HandShape | None) -> int:
    """How many fingers stand out as one that points does."""
    return 0 if hand is None else sum(finger.length >= POINTING_FINGER for finger in find_fingers(hand))


def lone_hand(mask: Mask) -> HandShape | None:
    """The hand at the end of the arm that comes into a mask (h, w), cut from a bare forearm as the tracker cuts it; none where
    there is none. Nothing tells its size but the hand itself: palms are taken to be PALM_RADIUS wide, first of hand and
    forearm, then of what was cut.
    """
    piece = _largest_piece(mask)
    radius = _radius(piece)
    if radius < 1:
        return None
    entered = _entered_at(piece)
    config = TrackerConfig()
    cut = cut_hand(piece, 0, 0, entered, radius / PALM_RADIUS * FACE_WIDTH_M / HEAD_WIDTH_M, config.hand_length, None)
    way = np.array(cut.centroid) - entered
    place = np.array(CHEST) + REACH * way / max(1e-6, float(np.hypot(*way)))
    return hand_on(cut.mask, (float(place[0]), float(place[1])))


def hand_on(mask: Mask, place: tuple[float, float]) -> HandShape | None:
    """The largest piece of a mask (h, w) as a hand; `place` of its middle about the face, face widths. None without one."""
    piece = _largest_piece(mask)
    radius = _radius(piece)
    if radius < 1:
        return None
    outline = outline_of(piece).astype(np.float32)
    scaled = (outline - outline.mean(axis=0)) * (PALM_RADIUS / radius) + np.array(place, np.float32)
    return hand_of(np.asarray(scaled, np.float32))


def outline_of(piece: Mask) -> NDArray[np.int32]:
    """Of one piece, (n, 2), x and y."""
    outlines, _ = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.asarray(max(outlines, key=cv2.contourArea)[:, 0, :], np.int32)


def _largest_piece(mask: Mask) -> Mask:
    """Without holes."""
    piece = np.zeros(mask.shape, np.uint8)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if outlines:
        cv2.drawContours(piece, [max(outlines, key=cv2.contourArea)], -1, (1,), cv2.FILLED)
    return piece


def _radius(piece: Mask) -> float:
    """Of the largest circle in it, pixels."""
    return float(cv2.distanceTransform(np.pad(piece, 1), cv2.DIST_L2, 3).max())


def _entered_at(piece: Mask) -> tuple[float, float]:
    """Where the arm comes into the picture; from below where it touches no border."""
    rows, columns = np.nonzero(piece)
    height, width = piece.shape
    at = (rows < BORDER_PX) | (rows >= height - BORDER_PX) | (columns < BORDER_PX) | (columns >= width - BORDER_PX)
    return (float(columns[at].mean()), float(rows[at].mean())) if at.any() else (float(columns.mean()), float(height))


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
