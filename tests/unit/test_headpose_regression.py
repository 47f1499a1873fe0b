import os
from functools import cache

import numpy as np
import pytest
from deixis_headpose.head import Pose
from deixis_headpose.head_crop import CROP_M, INPUT_PX
from deixis_headpose.regressed_head import angles_of
from deixis_headpose.regression import EARS_APART_M, Regression, _convolved, standardised
from deixis_simulation.arms import hanging_arm
from deixis_simulation.avatars import FITTING_AVATARS, load_avatar
from deixis_simulation.body import fit_body
from deixis_simulation.portraits import _landmarks
from deixis_simulation.skeleton import SIDES, Posture, solve
from deixis_simulation.skinning import skin
from hypothesis import given, settings
from hypothesis import strategies as st
from simulation_ready import needs_renderer

REGRESSION = Regression()
AHEAD = np.array([0.0, 0.0, 1.0])
PORTRAITS = 48


@cache
def held_out_crops() -> list[tuple[np.ndarray, np.ndarray]]:
    """Crops of rendered people that the network was not fitted on, and their angles, degrees."""
    os.environ.setdefault("LP_NUM_THREADS", "1")
    import cv2
    from deixis_simulation.avatars import HELD_OUT_AVATARS
    from deixis_simulation.portraits import SIDE_M, SIDE_PX, portraits

    made = []
    for portrait in portraits(4711, HELD_OUT_AVATARS, PORTRAITS, rooms=2):
        scale = INPUT_PX / (CROP_M * SIDE_PX / SIDE_M)
        shift = (INPUT_PX - 1) / 2 - scale * portrait.centre_px
        warp = np.array([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])
        crop = cv2.warpAffine(portrait.picture, warp, (INPUT_PX, INPUT_PX), borderMode=cv2.BORDER_REPLICATE)
        made.append((crop, np.array(Pose(portrait.rotation, AHEAD).angles_deg())))
    return made


def test_a_breadth_of_one_is_ear_to_ear_of_the_people_it_was_fitted_on() -> None:
    breadths_m = []
    for name in FITTING_AVATARS:
        avatar = load_avatar(name)
        body = fit_body(avatar, float(avatar.vertices[:, 1].max()))
        skeleton = solve(body, Posture({side: hanging_arm(body, side) for side in SIDES}))
        breadths_m.append(_landmarks(avatar, skeleton, skin(skeleton, {}))[1])
    assert np.mean(breadths_m) == pytest.approx(EARS_APART_M, abs=0.001)


@needs_renderer
def test_a_textured_head_rendered_at_a_known_pose_is_read() -> None:
    """Of people whom the network has never seen, a third with an arm at the face, in any turn and light, by single looks."""
    errors = []
    for crop, true in held_out_crops():
        look = REGRESSION.look(crop)
        errors.append((np.array(angles_of(look)) - true + 180) % 360 - 180)
        assert look.head > 0.5
    yaw, pitch, roll = np.median(np.abs(errors), axis=0)
    assert yaw < 7
    assert pitch < 6
    assert roll < 6


@needs_renderer
def test_gain_and_offset_of_the_camera_do_not_matter() -> None:
    for crop, _ in held_out_crops()[:12]:
        dimmed = np.round(0.6 * crop.astype(float) + 40).astype(np.uint8)  # from 40 to 193: nothing is clipped
        apart = np.array(angles_of(REGRESSION.look(crop))) - angles_of(REGRESSION.look(dimmed))
        assert np.abs((apart + 180) % 360 - 180).max() < 3


@given(st.integers(0, 2**31))
@settings(max_examples=15, deadline=None)
def test_mirrored_pictures_give_mirrored_yaw_and_roll(seed: int) -> None:
    crop = np.random.default_rng(seed).integers(0, 256, (INPUT_PX, INPUT_PX, 3), dtype=np.uint8)
    one, other = REGRESSION.look(crop), REGRESSION.look(np.ascontiguousarray(crop[:, ::-1]))
    assert np.array(angles_of(one)) == pytest.approx(np.array(angles_of(other)) * (-1, 1, -1), abs=1e-2)
    assert one.offset == pytest.approx(other.offset * (-1, 1), abs=1e-4)
    assert one.breadth == pytest.approx(other.breadth, rel=1e-4)


def test_where_nothing_is_no_head_is_seen() -> None:
    assert REGRESSION.look(np.full((INPUT_PX, INPUT_PX, 3), 120, np.uint8)).head < 0.5


def test_what_is_read_is_a_rotation() -> None:
    look = REGRESSION.look(np.random.default_rng(2).integers(0, 256, (INPUT_PX, INPUT_PX, 3), dtype=np.uint8))
    assert look.rotation @ look.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(look.rotation) == pytest.approx(1.0)


@pytest.mark.parametrize(("size", "stride"), [(3, 1), (3, 2), (4, 2)])
def test_convolutions_are_those_of_the_textbook(size: int, stride: int) -> None:
    rng = np.random.default_rng(1)
    values, kernel = rng.normal(size=(2, 8, 8, 3)).astype(np.float32), rng.normal(size=(size, size, 3, 5)).astype(np.float32)
    bias = rng.normal(size=5).astype(np.float32)
    padded = np.pad(values, ((0, 0), (1, size), (1, size), (0, 0)))
    for n, row, column in ((0, 0, 0), (1, 2, 3), (1, 8 // stride - 1, 8 // stride - 1)):
        window = padded[n, row * stride : row * stride + size, column * stride : column * stride + size]
        expected = np.einsum("ijc,ijcd->d", window, kernel) + bias
        assert _convolved(values, kernel, bias, stride)[n, row, column] == pytest.approx(expected, abs=1e-4)


def test_crops_are_standardised_each_by_itself() -> None:
    crops = np.stack([np.full((8, 8, 3), 50, np.uint8), np.arange(192, dtype=np.uint8).reshape(8, 8, 3)])
    flat, full = standardised(crops)
    assert not flat.any()
    assert (full.mean(), full.std()) == pytest.approx((0, 1), abs=1e-5)
