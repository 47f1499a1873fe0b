import numpy as np
import pytest
from deixis_headpose.head import Pose, ellipsoid, facing_camera, project, rotation_of
from deixis_runtime.lens import Pinhole
from hypothesis import example, given, settings
from hypothesis import strategies as st

CAMERA = Pinhole(560.0, 319.5, 239.5)
SURFACE = ellipsoid((0.08, 0.115, 0.085), 300, -0.92, 0.85)
angle = st.floats(-80, 80)


@given(yaw=angle, pitch=st.floats(-40, 40), roll=st.floats(-40, 40), x=st.floats(-1, 1))
def test_angles_are_read_back_as_they_were_set(yaw: float, pitch: float, roll: float, x: float) -> None:
    position = np.array([x, 0.1, 2.0])
    rotation = facing_camera(position) @ rotation_of(*np.radians([yaw, pitch, roll]))
    assert Pose(rotation, position).angles_deg() == pytest.approx((yaw, pitch, roll), abs=1e-6)


def test_a_head_turned_toward_image_right_shows_its_nose_to_the_right_of_its_centre() -> None:
    pose = Pose(rotation_of(np.radians(40), 0), np.array([0.0, 0.0, 2.0]))
    nose = pose.rotation @ np.array([0.0, 0.0, -0.1])
    assert nose[0] > 0.05
    assert pose.angles_deg()[0] == pytest.approx(40)


def test_yaw_is_relative_to_the_line_from_head_to_camera() -> None:
    aside = np.array([0.5, 0.0, 2.0])  # right in the image: to look along the axis is to look to the camera's right of it
    assert Pose(np.eye(3), aside).angles_deg()[0] == pytest.approx(np.degrees(np.arctan2(0.5, 2.0)))


@settings(max_examples=20)
@given(turn=st.tuples(angle, angle, angle))
def test_the_jacobian_is_the_derivative_of_the_projection(turn: tuple[float, float, float]) -> None:
    pose = Pose(rotation_of(*np.radians(turn)), np.array([0.3, -0.2, 1.8]))
    seen = project(SURFACE, pose, CAMERA, least_facing=-1)
    along_x, along_y = np.tile([1.0, 0.0], (len(seen.points), 1)), np.tile([0.0, 1.0], (len(seen.points), 1))
    jacobian = np.stack([seen.by_pose(along_x), seen.by_pose(along_y)], axis=1)
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-5
        ahead = project(SURFACE, pose.moved(step), CAMERA, least_facing=-1).pixels
        behind = project(SURFACE, pose.moved(-step), CAMERA, least_facing=-1).pixels
        assert np.allclose((ahead - behind) / 2e-5, jacobian[:, :, k], atol=0.05, rtol=1e-3)


@settings(max_examples=20)
@given(a=st.tuples(angle, angle, angle), b=st.tuples(angle, angle, angle))
@example(a=(0.0, 0.0, 0.0), b=(0.0, 0.0, 0.0002128))
def test_a_step_between_two_poses_leads_from_one_to_the_other(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> None:
    one = Pose(rotation_of(*np.radians(a)), np.array([0.0, 0.0, 2.0]))
    other = Pose(rotation_of(*np.radians(b)), np.array([0.1, -0.1, 2.2]))
    there = one.moved(other.step_from(one))
    assert np.allclose(there.rotation, other.rotation, atol=1e-6)
    assert np.allclose(there.position_m, other.position_m)


def test_surface_points_lie_on_the_ellipsoid_and_half_of_them_face_the_camera() -> None:
    assert np.allclose(np.sum((SURFACE.points_m / [0.08, 0.115, 0.085]) ** 2, axis=1), 1)
    facing = project(SURFACE, Pose(np.eye(3), np.array([0.0, 0.0, 3.0])), CAMERA).points
    assert 0.4 < len(facing) / len(SURFACE.points_m) < 0.5
