import pytest
from deixis_runtime.camera_lens import CameraLens
from deixis_runtime.lens import Lens
from deixis_schemas.messages import CameraInfo


def info(focal_px: float | None, width: int = 640, height: int = 480) -> CameraInfo:
    matrix = (focal_px, 0, width / 2, 0, focal_px, height / 2, 0, 0, 1) if focal_px else None
    return CameraInfo(
        stamp_ns=1, stage="camera", instance="c", state="streaming", source="/dev/video0", width=width, height=height,
        camera_matrix=matrix,
    )  # fmt: skip


def test_until_the_camera_tells_its_lens_one_is_assumed_and_that_is_said() -> None:
    lens = CameraLens(60.0)
    assert lens.of_frame(640, 480) == Lens.assumed(640, 480, 60.0)
    assert lens.note is not None
    assert "60 degrees" in lens.note


def test_the_note_is_taken_back_once_the_camera_tells_its_lens() -> None:
    lens = CameraLens(60.0)
    lens.hear([info(400.0)])
    assert lens.note is None
    assert lens.of_frame(640, 480).focal_x_px((640, 480)) == pytest.approx(400.0)


def test_the_last_of_several_infos_counts() -> None:
    lens = CameraLens(60.0)
    lens.hear([info(400.0), info(500.0)])
    assert lens.of_frame(640, 480).focal_x_px((640, 480)) == pytest.approx(500.0)


def test_a_frame_of_another_size_is_seen_through_the_same_lens() -> None:
    lens = CameraLens(60.0)
    lens.hear([info(1000.0, 1280, 960)])
    assert lens.of_frame(640, 480).focal_x_px((640, 480)) == pytest.approx(500.0)


def test_a_camera_that_starts_again_without_intrinsics_does_not_take_back_its_lens() -> None:
    lens = CameraLens(60.0)
    lens.hear([info(400.0), info(None)])
    assert lens.note is None
    assert lens.of_frame(640, 480).focal_x_px((640, 480)) == pytest.approx(400.0)


def test_a_lens_that_cannot_be_is_refused_with_its_cause_and_health_says_so_until_a_good_one_comes() -> None:
    lens = CameraLens(60.0)
    refused = lens.hear([info(1.0)])
    assert refused == [
        "camera/c: camera_matrix: a focal length of 1 pixels is a view 179.64 degrees wide; 5 to 170 can be",
    ]  # fmt: skip
    assert lens.of_frame(640, 480) == Lens.assumed(640, 480, 60.0)
    assert lens.note == f"camera/info: the lens of {refused[0]}; one 60 degrees wide is assumed"
    assert lens.hear([info(400.0)]) == []
    assert lens.note is None


def test_after_a_lens_that_cannot_be_the_one_told_before_is_used() -> None:
    lens = CameraLens(60.0)
    assert len(lens.hear([info(400.0), info(1e9)])) == 1
    assert lens.of_frame(640, 480).focal_x_px((640, 480)) == pytest.approx(400.0)
    assert lens.note is not None
    assert lens.note.endswith("the one told before is used")


def test_pictures_of_another_aspect_ratio_are_said_as_long_as_they_come() -> None:
    lens = CameraLens(60.0)
    lens.hear([info(400.0)])
    lens.of_frame(640, 360)
    assert lens.note == (
        "camera/info: the lens is for 640 x 480, pictures have 640 x 360: another aspect ratio, so angles are misread"
    )
    lens.of_frame(320, 240)
    assert lens.note is None
