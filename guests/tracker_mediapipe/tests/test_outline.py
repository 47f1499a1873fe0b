"""Outlines about landmarks, and the part of the picture in which hands are looked for."""

import cv2
import numpy as np
import pytest
from deixis_schemas.messages import MAX_CONTOUR_BYTES
from deixis_tracker_mediapipe.outline import centroid_of, outline_of
from deixis_tracker_mediapipe.regions import HandRegion, region_about
from hypothesis import given
from hypothesis import strategies as st

# A hand that shows its palm, fingers up, middle finger straight: centimetres, y down, wrist at the origin.
OPEN_CM = np.array(
    [(0, 0), (3, -2), (5, -4), (6.5, -5.5), (7.5, -7), (2.5, -9), (3, -12), (3.2, -14), (3.4, -16), (0.5, -9.5), (0.5, -13),
     (0.5, -15.5), (0.5, -17.5), (-1.5, -9), (-2, -12), (-2.2, -14), (-2.4, -16), (-3.5, -8), (-4.5, -10), (-5, -12),
     (-5.5, -13)]
)  # fmt: skip


@pytest.mark.parametrize("scale", [1.5, 4.0, 40.0])
def test_the_outline_holds_palm_and_fingertips_and_no_forearm(scale):
    points = OPEN_CM * scale + (300, 400)
    outline = outline_of(points)
    for tip in (4, 8, 12, 16, 20, 9):
        assert cv2.pointPolygonTest(outline.astype(np.float32), tuple(map(float, points[tip])), True) > -2 * max(1, scale / 8)
    assert outline[:, 1].max() < 400 + 2.5 * scale + 3
    assert len(outline.astype("<i2").tobytes()) < MAX_CONTOUR_BYTES
    x, y = centroid_of(outline, points)
    assert abs(x - 300) < 2 * scale
    assert 400 - 12 * scale < y < 400 - 4 * scale


def test_between_spread_fingers_there_is_no_hand():
    points = OPEN_CM * 8 + (300, 400)
    between = (points[4] + points[8]) / 2
    assert cv2.pointPolygonTest(outline_of(points).astype(np.float32), tuple(map(float, between)), False) < 0


def test_landmarks_on_one_point_have_no_outline():
    assert len(outline_of(np.full((21, 2), 7.0))) == 0


@given(st.lists(st.tuples(st.floats(-3000, 9000), st.floats(-3000, 9000)), min_size=21, max_size=21))
def test_any_landmarks_have_a_bounded_outline(points):
    outline = outline_of(np.array(points))
    assert len(outline) * 4 <= MAX_CONTOUR_BYTES
    assert np.abs(outline).max(initial=0) < 32000


def test_the_region_is_cut_to_the_picture():
    left, top, width, height = region_about((30.0, 50.0), 40.0, (640, 480))
    assert (left, top) == (0, 0)
    assert (width, height) == (230, 298)
    assert region_about((-5000.0, 50.0), 40.0, (640, 480)) == (0, 0, 640, 480)


def test_the_region_stays_until_the_face_has_gone_some_way():
    region = HandRegion()
    first = region.about((300.0, 200.0), 40.0, (640, 480))
    assert region.about((320.0, 210.0), 42.0, (640, 480)) == first
    assert region.about((345.0, 200.0), 40.0, (640, 480)) != first
