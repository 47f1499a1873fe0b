"""What CameraInfo says, and when it is news."""

import pytest
from deixis_camera.calibration import Intrinsics
from deixis_camera.config import CameraConfig, Mount
from deixis_runtime.camera_status import CameraStatus
from deixis_schemas import codec
from deixis_schemas.messages import CameraInfo, CameraMount, Producer
from pydantic import ValidationError

K = (500.0, 0.0, 319.5, 0.0, 500.0, 239.5, 0.0, 0.0, 1.0)


def status(mount: Mount | None = None) -> CameraStatus:
    return CameraStatus(Producer("camera", "a"), "clip.mp4", mount or Mount(), lockstep=False)


@pytest.mark.parametrize("number", [8, 12, 14])
def test_all_coefficients_of_a_calibration_are_carried(number: int) -> None:
    camera = status()
    distortion = tuple(0.01 * i for i in range(number))
    assert camera.projects(640, 480, Intrinsics(K, "rational_polynomial", distortion, "calibration 'cam.yaml'"))
    sent = codec.decode(CameraInfo, codec.encode(camera.info(1)), codec.encoding_of(CameraInfo))
    assert (sent.distortion_model, tuple(sent.distortion), sent.camera_matrix) == ("rational_polynomial", distortion, K)


def test_the_last_frame_is_named_by_run_and_seq_and_is_no_news() -> None:
    camera = status()
    assert camera.info(1).last_seq == -1, "none yet"
    camera.changed = False
    camera.published(7001, 12)
    assert (camera.info(5).run, camera.info(5).last_seq, camera.info(5).stamp_ns) == (7001, 12, 5)
    assert not camera.changed


def test_what_is_said_again_is_no_news() -> None:
    camera = status()
    camera.become("retrying", "camera 'x' is not there")
    camera.has_rate(30.0)
    camera.changed = False
    assert not camera.become("retrying", "camera 'x' is not there")
    camera.has_rate(30.0)
    assert not camera.changed
    assert camera.become("streaming")
    assert camera.changed
    assert camera.info(1).reason == ""


def test_a_message_that_was_given_out_does_not_change_later() -> None:
    camera = status()
    before = camera.info(1)
    camera.become("failed", "no such file")
    assert before.state == "starting"


def test_the_mount_of_the_settings_is_carried_with_its_roll() -> None:
    config = CameraConfig.model_validate({"mount": {"position_m": [0.1, 0, 1.4], "pitch_up_deg": 5, "roll_deg": -2}})
    mount = status(config.mount).info(1).mount
    assert type(mount) is CameraMount
    assert (mount.position_m, mount.yaw_deg, mount.pitch_up_deg, mount.roll_deg) == ((0.1, 0.0, 1.4), 0.0, 5.0, -2.0)


@pytest.mark.parametrize("field", ["pitch_deg", "roll", "positon_m"])
def test_a_misspelt_field_of_the_mount_is_refused_by_its_name(field: str) -> None:
    with pytest.raises(ValidationError, match=field):
        CameraConfig.model_validate({"mount": {field: 5}})
