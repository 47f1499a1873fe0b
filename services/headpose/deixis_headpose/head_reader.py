"""Look by look: where in the picture to look for a head, and what the regression reads there."""

from __future__ import annotations

import math

import numpy as np
from deixis_runtime.lens import Pinhole
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import MAX_SIDE_PX, Point, Track

from .head_crop import INPUT_PX, HeadPlace, crop_to_picture, cut_head
from .regression import EARS_APART_M, Look, Regression
from .sight import Sight, centre_of

LEAST_HEAD = 0.5
"""Below this share the network sees no head."""
FOLLOW, FOLLOW_WIDTH = 0.5, 0.12
"""Shares of what a look says of the head's place and width that are believed at once."""
STRAYED = 0.3
"""The place is taken from the track anew where it is farther from it than this, in sides of the crop."""
WIDTH_LIMITS = 0.75, 1.33
"""The face's width is held within these times the track's."""


class HeadReader:
    """Reads one head. The track says about where it is; the last look says where in the track's box."""

    def __init__(self, regression: Regression) -> None:
        self._regression = regression
        self._place: HeadPlace | None = None
        self._track_px: Point = (0.0, 0.0)

    def read(self, sight: Sight) -> Look | None:
        """The head in the next frame; none where none is seen."""
        place = self._followed(sight)
        if place is None:
            # By the track alone the crop may be far off: look once to find the head, and again to read it.
            place = HeadPlace(centre_of(sight.face), sight.face.bbox_px[2])
            place = _held(found_by(self._look(sight, place), place, sight.camera), sight.face)
        look = self._look(sight, place)
        if look.head < LEAST_HEAD:
            self._place = None
            return None
        self._place = _held(_mixed(place, found_by(look, place, sight.camera)), sight.face)
        self._track_px = centre_of(sight.face)
        return look

    @property
    def face_width_px(self) -> float | None:
        """How wide the face would be from the front, by the looks so far; none where no head is seen."""
        return self._place.face_width_px if self._place is not None else None

    def _look(self, sight: Sight, place: HeadPlace) -> Look:
        return self._regression.look(cut_head(sight.picture, place, sight.camera))

    def _followed(self, sight: Sight) -> HeadPlace | None:
        """Where the last look's head has gone with the track; none without one, and where it has strayed from the track."""
        if self._place is None:
            return None
        (x, y), width = centre_of(sight.face), sight.face.bbox_px[2]
        at = self._place.centre_px[0] + x - self._track_px[0], self._place.centre_px[1] + y - self._track_px[1]
        if math.dist(at, (x, y)) > STRAYED * HeadPlace((x, y), width).side_px:
            return None
        return _held(HeadPlace(at, self._place.face_width_px), sight.face)


def _held(place: HeadPlace, face: Track) -> HeadPlace:
    """The place with a width that the track's box allows, and a message can say."""
    low, high = (min(limit * face.bbox_px[2], MAX_SIDE_PX) for limit in WIDTH_LIMITS)
    return HeadPlace(place.centre_px, min(max(place.face_width_px, low), high))


def found_by(look: Look, place: HeadPlace, camera: Pinhole) -> HeadPlace:
    """Where a look at `place` found the head."""
    middle = (INPUT_PX - 1) / 2
    x, y, w = crop_to_picture(place, camera) @ np.array([*(middle + look.offset * INPUT_PX), 1.0])
    return HeadPlace((x / w, y / w), look.breadth * place.side_px * FACE_WIDTH_M / EARS_APART_M)


def _mixed(place: HeadPlace, found: HeadPlace) -> HeadPlace:
    """Between where the head was expected and where it was found."""
    x, y = (a + FOLLOW * (b - a) for a, b in zip(place.centre_px, found.centre_px, strict=True))
    return HeadPlace((x, y), place.face_width_px * (found.face_width_px / place.face_width_px) ** FOLLOW_WIDTH)
