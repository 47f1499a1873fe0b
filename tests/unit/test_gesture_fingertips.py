"""Fingers of drawn hands, the rules on them, and the votes of a stroke."""

import math

import cv2
import numpy as np
import pytest
from deixis_gesture.fingertips import find_fingers
from deixis_gesture.hand import Face, hand_of, unpack_contour
from deixis_gesture.paper_stroke import PaperStroke
from deixis_gesture.rules import vote
from hypothesis import given, settings
from hypothesis import strategies as st

FACE_PX = 50.0


def _drawn(palm, fingers, wrist=None, radius=0.27, thickness=0.13, face_px=FACE_PX):
    """Outline of a hand: palm centre, finger (angle from x toward y down, length beyond the palm), wrist end; face widths."""
    size = int(16 * face_px)
    canvas = np.zeros((size, size), np.uint8)

    def px(point):
        return round((point[0] + 8) * face_px), round((point[1] + 8) * face_px)

    cv2.circle(canvas, px(palm), round(radius * face_px), 1, -1)
    for degrees, length in fingers:
        reach = radius + length - thickness / 2
        tip = palm[0] + reach * math.cos(math.radians(degrees)), palm[1] + reach * math.sin(math.radians(degrees))
        cv2.line(canvas, px(palm), px(tip), 1, max(1, round(thickness * face_px)))
    if wrist:
        cv2.line(canvas, px(palm), px(wrist), 1, round(0.34 * face_px))
    outlines, _ = cv2.findContours(canvas, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return max(outlines, key=len)[:, 0, :].astype(np.float32) / face_px - 8


def _seen(*args, **kwargs):
    hand = hand_of(_drawn(*args, **kwargs))
    assert hand is not None
    fingers = find_fingers(hand)
    return hand, fingers, vote(hand, fingers)


OPEN = [(-30, 0.5), (-60, 0.55), (-88, 0.58), (-115, 0.55)]


@pytest.mark.parametrize("face_px", [30.0, 50.0, 110.0])
@pytest.mark.parametrize(("x", "direction", "expected"), [(-3.0, 180, "point_right"), (3.0, 0, "point_left")])
def test_one_finger_held_sideways_points_to_its_side_at_any_distance(face_px, x, direction, expected):
    hand, fingers, seen = _seen((x, 1.1), [(direction, 0.55)], wrist=(x * 0.6, 1.3), face_px=face_px)
    assert len(fingers) == 1
    assert fingers[0].tip == pytest.approx((x + math.copysign(0.82, x), 1.1), abs=0.08)
    assert hand.palm == pytest.approx((x, 1.1), abs=0.15)
    assert seen == expected


@given(x=st.floats(-2.5, 2.5).filter(lambda x: abs(x) > 1.3), y=st.floats(-0.5, 1.0))
@settings(max_examples=25, deadline=None)
def test_an_open_hand_is_no_pointing_wherever_it_is_raised(x, y):
    _, fingers, seen = _seen((x, y), OPEN, wrist=(x, y + 1.0))
    assert len(fingers) >= 3
    assert seen == "other"


def test_an_upright_palm_with_closed_fingers_is_no_pointing():
    _, _, seen = _seen((1.7, 0.3), [(-90, 0.5), (-80, 0.5), (-100, 0.5)], wrist=(1.7, 1.4), thickness=0.3)
    assert seen == "other"


def test_a_fist_held_out_is_an_invisible_pointing_and_a_fist_before_the_body_is_nothing():
    assert _seen((2.0, 1.1), [], radius=0.22)[2] == "invisible"
    assert _seen((0.5, 1.9), [], radius=0.22)[2] == "unclear"


def test_a_finger_up_is_no_pointing_at_things():
    assert _seen((1.7, 0.4), [(-90, 0.55)], wrist=(1.7, 1.2))[2] == "other"


def test_the_thumb_beside_a_pointing_finger_does_not_open_the_hand():
    assert _seen((2.2, 1.0), [(0, 0.5), (-90, 0.22)], wrist=(1.2, 1.4))[2] == "point_left"


def test_the_outline_is_measured_as_it_is_and_not_cut_again():
    outline = np.array([[-3.0, 1.0], [-1.0, 1.0], [-1.0, 1.4], [-3.0, 1.4]], np.float32)
    hand = hand_of(outline)
    assert hand is not None
    assert hand.area == pytest.approx(2.0 * 0.4, rel=0.1)
    assert hand.centroid == pytest.approx((-2.0, 1.2), abs=0.05)
    assert hand.tip == pytest.approx((-3.0, 1.0))


def test_an_arm_across_the_body_points_where_the_finger_points():
    assert _seen((-1.5, 0.9), [(180, 0.4)], wrist=(-0.9, 1.1))[2] == "point_right"


def test_outlines_that_are_no_hand_give_none():
    assert hand_of(np.zeros((0, 2), np.float32)) is None
    assert hand_of(np.array([[1, 1], [1.01, 1], [1, 1.01]], np.float32)) is None
    assert hand_of(np.array([[-9, -9], [9, -9], [9, 9]], np.float32)) is None


def test_contours_unpack_to_the_pixels_they_hold():
    pairs = np.array([[3, -4], [500, 7]], "<i2")
    assert np.array_equal(unpack_contour(pairs.tobytes()), pairs)
    assert unpack_contour(b"").shape == (0, 2)


def test_face_widths_and_pixels_convert_both_ways():
    face = Face(300.0, 120.0, 50.0)
    assert face.pixels((2.0, -1.0)) == (400.0, 70.0)
    assert face.normalised([[400.0, 70.0]])[0] == pytest.approx((2.0, -1.0))


def _decided(votes, rate_hz=30, allowed=True):
    stroke = PaperStroke(0.2)
    return [stroke.count(i / rate_hz, seen, allowed) for i, seen in enumerate(votes)]


def test_a_stroke_is_decided_when_it_has_settled_and_not_before():
    said = _decided(["point_left"] * 15)
    assert said[:6] == ["none"] * 6
    assert set(said[6:]) == {"point_left"}


def test_a_few_open_hands_among_the_first_votes_forbid_pointing():
    assert _decided(["other", "point_left", "other"] * 4)[-1] == "other"


def test_a_finger_seen_in_some_frames_outweighs_invisible():
    assert _decided(["invisible", "invisible", "point_right"] * 4)[-1] == "point_right"


def test_flicker_does_not_change_a_decided_stroke():
    said = _decided(["point_left"] * 20 + ["invisible", "unclear", "other"] * 2 + ["point_left"] * 20)
    assert set(said[6:]) == {"point_left"}


def test_a_hand_that_opens_for_good_ends_the_pointing():
    assert _decided(["point_left"] * 20 + ["other"] * 30)[-1] == "other"


def test_invisible_needs_a_hand_that_was_seen_coming():
    assert _decided(["invisible"] * 20)[-1] == "invisible"
    assert _decided(["invisible"] * 20, allowed=False)[-1] == "other"
