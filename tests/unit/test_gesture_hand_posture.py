"""Postures of hands: drawn ones, those of people that nothing was fitted on, and when the stage speaks of them."""

import math
from collections import Counter

import cv2
import numpy as np
import pytest
from deixis_gesture.hand import CHEST, Face, HandShape, hand_of
from deixis_gesture.hand_posture import NAMED, PostureOdds, mean_of, posture_of, raster_of
from deixis_simulation.avatars import HELD_OUT_AVATARS
from deixis_simulation.lone_hands import PX_PER_FACE, lone_hands
from hypothesis import given, settings
from hypothesis import strategies as st


def hand_at(outline_px: np.ndarray, along: np.ndarray, reach: float = 2.5, px: float = PX_PER_FACE) -> HandShape:
    """An outline (n, 2), pixels, as the hand of an arm that goes that way from the chest."""
    place = outline_px.mean(axis=0) - px * (np.array(CHEST) + reach * np.array(along))
    hand = hand_of(Face(float(place[0]), float(place[1]), px).normalised(outline_px))
    assert hand is not None
    return hand


def drawn(fingers_deg: tuple[float, ...], arm_deg: float = 90.0, scale: float = 1.0) -> HandShape:
    """A fist on a wrist with fingers that stand out so far beside the arm's direction (degrees from x toward up)."""
    canvas, middle, px = np.zeros((600, 600), np.uint8), np.array([300.0, 300.0]), 100 * scale

    def at(degrees: float, length: float) -> list[int]:
        way = np.array([math.cos(math.radians(degrees)), -math.sin(math.radians(degrees))])
        return [round(float(v)) for v in middle + length * px * way]

    cv2.circle(canvas, [300, 300], round(0.25 * px), (1,), -1)
    cv2.line(canvas, [300, 300], at(arm_deg + 180, 0.5), (1,), round(0.32 * px))
    for degrees in fingers_deg:
        cv2.line(canvas, at(arm_deg + degrees, 0.1), at(arm_deg + degrees, 0.72), (1,), round(0.12 * px))
    outlines, _ = cv2.findContours(canvas, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    way = np.array([math.cos(math.radians(arm_deg)), -math.sin(math.radians(arm_deg))])
    return hand_at(max(outlines, key=len)[:, 0, :], way, px=px)


@given(arm_deg=st.floats(0, 360), scale=st.floats(0.4, 1.6))
@settings(max_examples=20, deadline=None)
def test_a_hand_looks_the_same_wherever_the_arm_points_and_however_near_it_is(arm_deg, scale):
    upright, turned = (raster_of(drawn((-8.0, 40.0), *given)) for given in ((90.0, 1.0), (arm_deg, scale)))
    assert np.abs(upright - turned).mean() < 0.05
    assert upright.sum() > 60


def test_one_finger_is_an_index_and_five_are_an_open_palm():
    assert max(zip(posture_of(drawn((0.0,))).shares, NAMED, strict=True))[1] == "index"
    assert posture_of(drawn((-50.0, -24.0, -4.0, 16.0, 36.0))).shares[NAMED.index("index")] < 0.1
    assert posture_of(drawn(())).shares[NAMED.index("index")] < 0.3


def test_what_is_not_sure_is_unknown():
    assert PostureOdds((0.4, 0.3, 0.1, 0.1, 0.1)).named == "unknown"
    assert PostureOdds((0.02, 0.92, 0.02, 0.02, 0.02)).named == "open"
    odds = mean_of([PostureOdds((1.0, 0.0, 0.0, 0.0, 0.0)), PostureOdds((0.6, 0.4, 0.0, 0.0, 0.0))])
    assert odds.shares == pytest.approx((0.8, 0.2, 0.0, 0.0, 0.0))
    assert odds.named == "index"


def test_hands_of_people_that_nothing_was_fitted_on_are_what_they_are_called():
    said: Counter[tuple[str, bool]] = Counter()
    for known in lone_hands(7_000_000, HELD_OUT_AVATARS, 400):
        outlines, _ = cv2.findContours(np.pad(known.mask, 2), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        odds = posture_of(hand_at(max(outlines, key=len)[:, 0, :], known.along))
        assert sum(odds.shares) == pytest.approx(1, abs=1e-5)
        said[odds.named, odds.named == known.shape] += 1
    sure = {name: (said[name, True], said[name, False]) for name in NAMED}
    assert all(right >= 2 * wrong for right, wrong in sure.values()), sure
    right, wrong = sure["index"]
    assert right >= 3 * wrong
    assert right >= 40  # of about a hundred, half of which no outline tells
