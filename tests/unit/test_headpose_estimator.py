import numpy as np
import pytest
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.estimator import HeadPoseEstimator
from deixis_schemas.messages import KindProbabilities, Track
from pydantic import ValidationError


def face(person: int, x: float, width: float) -> Track:
    return Track(
        track_id=person,
        person_id=person,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=(x + width / 2, 100 + width / 2),
        bbox_px=(x, 100, width, width),
        velocity_px_s=(0, 0),
    )


GREY = np.full((240, 320), 90, np.uint8)


def test_a_picture_without_persons_gives_no_heads() -> None:
    assert HeadPoseEstimator(HeadposeConfig()).update(GREY, [], 0) == []


def test_a_face_track_on_a_bare_wall_stays_initialising() -> None:
    estimator = HeadPoseEstimator(HeadposeConfig())
    statuses = {estimator.update(GREY, [face(4, 100, 50)], k)[0].status for k in range(8)}
    assert statuses == {"initialising"}


def test_only_the_largest_heads_are_estimated() -> None:
    estimator = HeadPoseEstimator(HeadposeConfig(max_persons=2))
    poses = estimator.update(GREY, [face(1, 10, 30), face(2, 100, 60), face(3, 200, 45)], 0)
    assert [pose.person_id for pose in poses] == [2, 3]


def test_a_face_at_the_edge_of_the_picture_is_no_error() -> None:
    estimator = HeadPoseEstimator(HeadposeConfig())
    assert estimator.update(GREY, [face(1, 315, 40)], 0)[0].status == "initialising"
    assert estimator.update(GREY, [face(1, -60, 40)], 1)[0].status == "initialising"


@pytest.mark.parametrize("shape", [(10, 10, 4), (10,)])
def test_a_picture_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="image: needs uint8"):
        HeadPoseEstimator(HeadposeConfig()).update(np.zeros(shape, np.uint8), [], 0)


def test_an_unknown_setting_is_refused_by_name() -> None:
    with pytest.raises(ValidationError, match="gatte"):
        HeadposeConfig.model_validate({"gatte": 0.5})
