"""Pictures of a painted ellipsoid at a known pose, and its tracks: for tests of the headpose core."""

import numpy as np
from deixis_headpose.head import Pose, ellipsoid, facing_camera, project, rotation_of
from deixis_runtime.lens import Lens, Pinhole
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import FrontalFace, KindProbabilities, Track

SIZE = (320, 240)
CAMERA = Pinhole(560.0, 159.5, 119.5)
LENS = Lens(*SIZE, (560.0, 560.0, 159.5, 119.5))
SEMI_AXES_M = (0.08, 0.115, 0.085)
SEEN_FROM_THE_FRONT_DEG = 15.0


def turned_to(yaw_deg: float, position_m: tuple[float, float, float] = (0.0, 0.0, 2.0)) -> Pose:
    """A head at a place, turned by so much from the line to the camera."""
    position = np.array(position_m)
    return Pose(facing_camera(position) @ rotation_of(np.radians(yaw_deg), 0.0), position)


def painted_head(pose: Pose, gain: float = 1.0, offset: float = 0.0) -> np.ndarray:
    """A picture (240, 320) of the ellipsoid with a smooth pattern on it, on a plain background, by splatting many points."""
    dense = ellipsoid(SEMI_AXES_M, 60000, -1.0, 1.0)
    x, y, z = (dense.points_m / 0.1).T
    grey = 128 + 40 * np.sin(7 * x + 1) + 30 * np.cos(6 * y) + 25 * np.sin(5 * z + 2 * x)
    seen = project(dense, pose, CAMERA)
    total, count = np.zeros(SIZE[::-1]), np.zeros(SIZE[::-1])
    at = np.rint(seen.pixels).astype(int)
    inside = np.all((at >= 0) & (at < SIZE), axis=1)
    column, row = at[inside].T
    np.add.at(total, (row, column), grey[seen.points[inside]])
    np.add.at(count, (row, column), 1)
    picture = np.where(count > 0, total / np.maximum(count, 1), 90.0)
    return np.clip(gain * picture + offset, 0, 255).astype(np.uint8)


def face_of(pose: Pose, person: int = 0) -> Track:
    """The track of that head's face as the contract describes it: seen from the front while it is turned by little."""
    x, y, z = (float(v) for v in pose.position_m)
    centre = (CAMERA.focal_px * x / z + CAMERA.centre_x_px, CAMERA.focal_px * y / z + CAMERA.centre_y_px)
    width = CAMERA.focal_px * FACE_WIDTH_M / z
    from_the_front = abs(pose.angles_deg()[0]) < SEEN_FROM_THE_FRONT_DEG
    return Track(
        track_id=person,
        person_id=person,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=centre,
        bbox_px=(centre[0] - (width - 1) / 2, centre[1] - (1.2 * width - 1) / 2, width, 1.2 * width),
        velocity_px_s=(0, 0),
        frontal=FrontalFace(centre_px=centre, width_px=width) if from_the_front else None,
    )
