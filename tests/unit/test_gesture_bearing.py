"""Bearing from one camera: a likelihood by arms of people who point, and what is made of it."""

import math

import numpy as np
import pytest
from deixis_gesture import bearing
from deixis_gesture.bearing import BEARINGS, ArmSight, HandSight, Ray, estimate_bearing, fitting_arms, likelihood_of
from deixis_gesture.hand import Face
from deixis_gesture.person import HEAD_ABOVE_FACE, View
from deixis_runtime.lens import Lens
from deixis_runtime.mount import to_base
from deixis_schemas.messages import CameraMount
from hypothesis import given, settings
from hypothesis import strategies as st

LENS = Lens.assumed(640, 480, 60.0)
DISTANCE = 11.0
RADIUS = 0.26
sides = st.sampled_from(["left", "right", None])


def sight_of(tip, fist, distance=DISTANCE, height=0.0):
    """How a tip and a fist (right, up, toward the camera; face widths) are seen from so far away."""

    def ray(place):
        right, up, toward = (float(value) for value in place)
        return Ray(right / (distance - toward), (height + up) / math.hypot(distance - toward, right))

    return ArmSight(ray(tip), ray(fist), RADIUS, distance, height)


def arms_likelihood(seen, side):
    arms = bearing.load_arms(side)
    return likelihood_of(fitting_arms(seen, arms), arms)


def held_arms(count, seed=1):
    """Arms like those of the file, each a mixture of two neighbours, so that none is one of them."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        side = str(rng.choice(["left", "right"]))
        arms = bearing.load_arms(side)
        k = int(rng.integers(len(arms.tips)))
        missed, shown = rng.normal(0, 0.2, 3), rng.normal(0, bearing.EXTENT_SIGMA, 3)
        yield BEARINGS[arms.share_of(k).argmax()], side, arms.tips[k] + missed, arms.fists[k] + missed + shown


@settings(deadline=None)  # the first example loads the arms
@given(st.floats(-0.6, 0.6), st.floats(-0.5, 0.3), st.floats(0.5, 1.2), st.floats(5, 40), sides)
def test_left_and_right_mirror_each_other(aside, slope, inner, distance, side):
    other = {"left": "right", "right": "left", None: None}[side]
    here = arms_likelihood(ArmSight(Ray(aside, slope), Ray(inner * aside, -0.1), RADIUS, distance, 1.0), side)
    there = arms_likelihood(ArmSight(Ray(-aside, slope), Ray(-inner * aside, -0.1), RADIUS, distance, 1.0), other)
    assert here[1:] == pytest.approx(there[:0:-1], abs=1e-4)
    assert here.max() == pytest.approx(1.0)
    assert here.min() > 0


def test_the_likelihood_covers_the_bearing_as_often_as_it_says():
    inside, ranks = [], []
    for truth, side, tip, fist in held_arms(400):
        told = arms_likelihood(sight_of(tip, fist), side)
        order = np.argsort(-told)
        share = np.cumsum(told[order]) / told.sum()
        place = int(np.nonzero(order == int(np.argmin(np.abs(BEARINGS - truth))))[0][0])
        inside.append(share[place])
        ranks.append(place)
    for level in (0.68, 0.95):
        assert np.mean(np.array(inside) <= level) == pytest.approx(level, abs=0.12)
    assert np.median(ranks) < 6


def test_pointing_aside_is_told_from_pointing_ahead():
    aside = estimate_bearing(sight_of((4.2, -1.0, 0.6), (3.5, -1.1, 0.5)), "left")
    ahead = estimate_bearing(sight_of((0.6, -0.6, 3.4), (0.7, -0.8, 2.8)), "left")
    assert 50 < aside.deg < 110
    assert abs(ahead.deg) < 35


def test_an_arm_that_is_raised_points_higher():
    """Aside, by the person's left arm: from the shoulder's height a face width up, and three down."""
    low, level, high = (estimate_bearing(sight_of((3.8, up, 0.6), (3.2, up - 0.2, 0.5)), "left") for up in (-3.0, -1.0, 1.0))
    assert low.elevation_deg + 15 < level.elevation_deg < high.elevation_deg - 10
    for told in (low, level, high):
        assert 3 < told.elevation_sigma_deg < 30


def test_the_elevation_is_within_its_sigma_as_often_as_it_says():
    """Of arms of the file, measured badly; each is left out of those that it is read by."""
    arms, rng, off = bearing.load_arms("left"), np.random.default_rng(3), []
    for k in rng.integers(len(arms.tips), size=300):
        missed, distance = rng.normal(0, 0.2, 3) * (1, 1, 0), rng.uniform(7, 20)
        found = fitting_arms(sight_of(arms.tips[k] + missed, arms.fists[k] + missed, distance), arms)
        others = found.rows != k
        rows, fits = found.rows[others], found.fits[others]
        mean, spread = bearing._moments(arms.elevations[rows], fits)
        off.append((arms.elevations[k] - mean) / max(bearing.LEAST_SIGMA_DEG, spread))
    assert np.mean(np.abs(off) < 1) == pytest.approx(0.68, abs=0.12)
    assert np.mean(np.abs(off) < 1.96) == pytest.approx(0.95, abs=0.06)


def test_the_arms_of_all_sides_share_one_table():
    """It is what a gesture stage holds most of: a copy for each side took 28 MB at its start, three tables and their making."""
    left, right, both = (bearing.load_arms(side) for side in ("left", "right", None))
    assert left.shares is both.shares
    assert right.shares is both.shares
    assert left.share_of(np.arange(3)) == pytest.approx(both.share_of(left.rows[:3]))
    assert sorted([*left.rows, *right.rows]) == both.rows.tolist()
    assert both.shares.sum(axis=0) == pytest.approx(1.0, abs=1e-4)


def test_a_finger_that_shows_points_ahead_rather_than_behind():
    tip = (2.4, -1.1, 0.0)
    whole, short = (arms_likelihood(sight_of(tip, (2.4 - shown, -1.1, 0.0)), "left") for shown in (0.6, 0.3))
    ahead, behind = (np.abs(BEARINGS - at).argmin() for at in (25.0, 130.0))
    assert whole[ahead] / whole[behind] > 3 * short[ahead] / short[behind]


def test_a_finger_that_is_lost_leaves_every_bearing_possible():
    tip = (4.2, -1.0, 0.6)
    seen, lost = (arms_likelihood(sight_of(tip, (4.2 - shown, -1.0, 0.5)), "left") for shown in (0.75, 0.25))
    assert (lost > 0.05 * seen).all()


@pytest.mark.parametrize("name", ["OUTLIERS", "TIP_SIGMA", "FAR_TIP_SIGMA", "EXTENT_SIGMA", "DIRECTION_SIGMA"])
def test_a_constant_that_is_tried_counts(monkeypatch, name):
    """As `fitting/choose_bearing.py` tries them."""
    seen = sight_of((3.6, -1.0, 0.6), (3.1, -1.2, 0.5))
    before = arms_likelihood(seen, "left")
    monkeypatch.setattr(bearing, name, 2 * getattr(bearing, name))
    assert np.abs(arms_likelihood(seen, "left") - before).max() > 0.01


def test_a_tip_where_no_arm_reaches_tells_nothing():
    nowhere = arms_likelihood(sight_of((9.0, 6.0, 0.0), (8.4, 5.8, 0.0)), "left")
    assert nowhere.min() == nowhere.max() == 1.0
    assert estimate_bearing(sight_of((9.0, 6.0, 0.0), (8.4, 5.8, 0.0)), "left").elevation_deg is None


def test_a_camera_that_is_tilted_and_rolled_sees_the_same_pointing():
    tip, head = np.array([3.0, -1.2, 1.5]), np.array([DISTANCE, 0.8, 1.5])  # head: forward, left, up of the camera
    forward = head[:2] / np.hypot(*head[:2])
    left = np.array([-forward[1], forward[0]])
    place = np.array([*(head[:2] - tip[0] * left - tip[2] * forward), head[2] + tip[1]])
    seen = []
    for mount in (CameraMount(), CameraMount(pitch_up_deg=12, roll_deg=7), CameraMount(pitch_up_deg=-9, yaw_deg=40)):
        to_level = np.column_stack([to_base(axis, mount) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))])
        turned = math.radians(mount.yaw_deg)
        yaw = np.array([[math.cos(turned), -math.sin(turned), 0], [math.sin(turned), math.cos(turned), 0], [0, 0, 1]])
        seen.append(view_of(mount, *(to_level.T @ yaw @ at for at in (head, place))))
    for other in seen[1:]:
        assert (other.tip.aside, other.tip.slope) == pytest.approx((seen[0].tip.aside, seen[0].tip.slope), abs=0.01)
        assert (other.fist.aside, other.fist.slope) == pytest.approx((seen[0].fist.aside, seen[0].fist.slope), abs=0.01)
        assert (other.distance, other.height) == pytest.approx((seen[0].distance, seen[0].height), rel=0.03)
    assert seen[0].tip.aside == pytest.approx(3.0 / (np.hypot(*head[:2]) - 1.5), abs=0.02)


def view_of(mount, head, tip):
    """What the stage makes of a head and a tip at these places of the optical frame, face widths."""
    fx, fy, cx, cy = LENS.matrix
    (x, y), (tip_x, tip_y) = ((fx * p[0] / p[2] + cx, fy * p[1] / p[2] + cy) for p in (head, tip))
    width = LENS.pinhole_at((x, y), (640, 480)).focal_px / float(np.linalg.norm(head))
    face = Face(x, y + HEAD_ABOVE_FACE * width, width)
    tip = (tip_x - face.x_px) / width, (tip_y - face.y_px) / width
    return View(LENS, (640, 480), mount).arm_of(face, HandSight(tip, (0.8 * tip[0], 0.8 * tip[1]), RADIUS))


@pytest.mark.parametrize("distance", [0.0, -1.0, float("nan")])
def test_a_distance_that_is_none_is_refused_by_name(distance):
    with pytest.raises(ValueError, match="distance"):
        estimate_bearing(ArmSight(Ray(0.3, 0.0), Ray(0.25, 0.0), RADIUS, distance, 0.0), None)
