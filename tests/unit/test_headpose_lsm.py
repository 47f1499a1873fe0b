import numpy as np
import pytest
from deixis_headpose.head import Pose, ellipsoid, rotation_of
from deixis_headpose.keyframes import Keyframe, take_keyframe
from deixis_headpose.lsm import match
from deixis_headpose.neck import Neck
from deixis_headpose.patch import Level, pyramid
from deixis_runtime.lens import Pinhole
from painted_head import CAMERA, SEMI_AXES_M, painted_head

SURFACE = ellipsoid(SEMI_AXES_M, 900, -0.92, 0.85)
START = Pose(np.eye(3), np.array([0.0, 0.0, 2.0]))


def levels_of(picture: np.ndarray) -> list[Level]:
    return pyramid(picture, (159.5, 119.5), 45.0, 64.0, 3)


@pytest.fixture(scope="module")
def keyframe() -> Keyframe:
    return take_keyframe(levels_of(painted_head(START)), SURFACE, START, CAMERA)


@pytest.mark.parametrize("yaw", [-12.0, 5.0, 12.0])
def test_matching_finds_the_turn_of_a_painted_ellipsoid(keyframe: Keyframe, yaw: float) -> None:
    truth = Pose(rotation_of(np.radians(yaw), 0), np.array([0.0, 0.0, 2.0]))
    levels = levels_of(painted_head(truth))
    found = START
    for k in (2, 1, 0):
        result = match(levels[k], SURFACE, [keyframe.templates[k]], found, CAMERA, Neck(START).prior(found, 1 / 30), 12)
        found = result.pose
    assert result.correlation > 0.95
    assert found.angles_deg()[0] == pytest.approx(yaw, abs=2.5)


def test_a_change_of_light_does_not_turn_the_head(keyframe: Keyframe) -> None:
    levels = levels_of(painted_head(START, gain=0.6, offset=40))
    result = match(levels[0], SURFACE, [keyframe.templates[0]], START, CAMERA, Neck(START).prior(START, 1 / 30), 12)
    assert result.pose.angles_deg()[0] == pytest.approx(0, abs=0.5)
    assert result.correlation > 0.98


def test_a_picture_without_the_head_correlates_below_the_gate(keyframe: Keyframe) -> None:
    noise = np.random.default_rng(3).integers(0, 255, (240, 320), dtype=np.uint8)
    levels = levels_of(noise)
    result = match(levels[0], SURFACE, [keyframe.templates[0]], START, CAMERA, Neck(START).prior(START, 1 / 30), 12)
    assert result.correlation < 0.75


def test_a_head_cut_by_the_edge_of_the_picture_is_no_error(keyframe: Keyframe) -> None:
    picture = painted_head(START)[:, 150:]
    levels = pyramid(picture, (9.5, 119.5), 45.0, 64.0, 3)
    aside = Pinhole(560.0, 9.5, 119.5)
    result = match(levels[0], SURFACE, [keyframe.templates[0]], START, aside, Neck(START).prior(START, 1 / 30), 3)
    assert np.isfinite(result.pose.position_m).all()
