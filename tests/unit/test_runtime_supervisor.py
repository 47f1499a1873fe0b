"""Children that cannot be started or end in odd ways."""

import signal
import time

import pytest
from deixis_runtime.supervisor import Supervisor, say_status


@pytest.mark.parametrize(
    ("status", "said"),
    [(-9, "killed by SIGKILL"), (-(signal.SIGRTMIN + 5), "killed by signal"), (3, "status 3"), (69, "no router")],
)
def test_each_end_is_said_in_words(status, said):
    assert said in say_status(status)


def test_a_command_that_is_not_there_is_given_up_and_leaves_the_others():
    supervisor = Supervisor()
    supervisor.start("good", ["sleep", "60"])
    supervisor.start("absent", ["/nowhere/at-all"])
    supervisor.poll()
    assert supervisor.failed() == {"absent": "it cannot be started: No such file or directory"}
    assert supervisor.processes["good"].running
    began_s = time.monotonic()
    supervisor.stop()
    assert not supervisor.processes["good"].running
    assert time.monotonic() - began_s < 3
