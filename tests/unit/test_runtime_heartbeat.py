"""When the next health record is due."""

from deixis_runtime.heartbeat import Heartbeat
from deixis_schemas.messages import Producer


def test_a_record_that_is_hastened_is_due_sooner_and_never_later():
    heartbeat = Heartbeat(Producer("fusion", "a"))
    heartbeat.hasten(5.0)
    assert heartbeat.due_in_s() == 0.0, "the first is due at once"
    heartbeat.beat()
    assert 0.5 < heartbeat.due_in_s() <= 1.0
    heartbeat.hasten(0.25)
    assert heartbeat.due_in_s() <= 0.25
