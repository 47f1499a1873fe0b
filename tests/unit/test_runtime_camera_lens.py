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


@pytest.mark.parametrize("size", [(640, 480), (1280, 960), (320, 240), (427, 320)])
def test_pictures_scaled_to_another_size_fit_the_lens(size: tuple[int, int]) -> None:
    lens = CameraLens(60.0)
    assert lens.misfit(*size) is None
    lens.hear([info(400.0)])
    assert lens.misfit(*size) is None


def test_pictures_of_another_aspect_ratio_do_not_fit_the_lens_and_both_sizes_are_said() -> None:
    lens = CameraLens(60.0)
    lens.hear([info(400.0)])
    said = lens.misfit(640, 360)
    assert said is not None
    assert "640 x 480" in said
    assert "640 x 360" in said
