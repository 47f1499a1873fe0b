"""When the next health record is due."""

from deixis_runtime.heartbeat import Heartbeat
from deixis_runtime.versions import distribution_of
from deixis_schemas.messages import Producer


def test_a_record_that_is_hastened_is_due_sooner_and_never_later():
    heartbeat = Heartbeat(Producer("fusion", "a"), "deixis-fusion")
    heartbeat.hasten(5.0)
    assert heartbeat.due_in_s() == 0.0, "the first is due at once"
    heartbeat.beat()
    assert 0.5 < heartbeat.due_in_s() <= 1.0
    heartbeat.hasten(0.25)
    assert heartbeat.due_in_s() <= 0.25


def test_the_versions_are_those_of_what_the_process_is_made_by():
    assert distribution_of("deixis_ros2.camera_service") == "deixis-ros2"
    assert distribution_of("deixis_camera.service") == "deixis-camera"
    record = Heartbeat(Producer("camera", "a"), "deixis-ros2").record(0, [], [])
    assert "deixis-schemas" in record.versions
    assert "deixis-camera" not in record.versions
