"""Children that cannot be started, end in odd ways, or do not stop; and what is said of them."""

import signal
import sys
import time

import pytest
from deixis_runtime.stage import EXIT_UNREACHABLE
from deixis_runtime.supervisor import Process, Supervisor, say_status
from deixis_runtime.supervisor_health import account_of

SLEEP = ["sleep", "60"]


@pytest.fixture
def supervisor():
    it = Supervisor()
    yield it
    it.stop()


@pytest.mark.parametrize(
    ("status", "said"),
    [(-9, "killed by SIGKILL"), (-(signal.SIGRTMIN + 5), "killed by signal"), (3, "status 3"), (69, "no router")],
)
def test_each_end_is_said_in_words(status, said):
    assert said in say_status(status)


def test_a_command_that_is_not_there_is_given_up_and_leaves_the_others(supervisor):
    supervisor.start("good", SLEEP)
    supervisor.start("absent", ["/nowhere/at-all"])
    supervisor.poll()
    assert supervisor.failed() == {"absent": "it cannot be started: No such file or directory"}
    assert supervisor.processes["good"].running
    began_s = time.monotonic()
    supervisor.stop()
    assert not supervisor.processes["good"].running
    assert time.monotonic() - began_s < 1


def test_a_killed_child_is_started_again_in_the_same_turn(supervisor):
    supervisor.start("child", SLEEP)
    (before,) = supervisor.running().values()
    supervisor.processes["child"].popen.kill()
    supervisor.processes["child"].popen.wait()
    supervisor.poll()
    assert supervisor.running()["child"] != before


def test_a_child_killed_for_hanging_has_that_for_a_reason(supervisor):
    supervisor.start("child", SLEEP)
    supervisor.kill("child", "gave no sign")
    supervisor.poll()
    assert supervisor.processes["child"].last_end == "gave no sign"


def test_a_child_that_ignores_sigterm_is_killed_and_all_are_gone_within_two_seconds(supervisor):
    deaf = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('x', flush=True); time.sleep(60)"
    supervisor.start("deaf", [sys.executable, "-c", deaf])
    supervisor.start("stopped", SLEEP)
    supervisor.processes["stopped"].popen.send_signal(signal.SIGSTOP)
    time.sleep(0.5)
    began_s = time.monotonic()
    supervisor.stop()
    assert not supervisor.running()
    assert time.monotonic() - began_s < 2


def test_a_stage_that_misses_its_router_is_not_given_up_for_that(supervisor):
    supervisor.start("router", ["false"])
    supervisor.start("stage", ["sh", "-c", f"exit {EXIT_UNREACHABLE}"], needs="router")
    until_s = time.monotonic() + 10
    while "router" not in supervisor.failed() and time.monotonic() < until_s:
        supervisor.poll()
        time.sleep(0.01)
    assert supervisor.failed() == {"router": "it ended 6 times within 60 s, the last time: status 1"}
    assert supervisor.processes["stage"].started < 10, "nor started in haste"


def test_what_is_said_of_the_children():
    well = Process("camera", SLEEP, started=1)
    back = Process("fusion", SLEEP, started=3, last_end="killed by SIGKILL", ended_s=88.0)
    lost = Process("gesture", SLEEP, started=6, last_end="status 1", ended_s=90.0, given_up="it ended 6 times")
    account = account_of([well, back, lost], 100.0)
    assert (account.state, account.reason) == ("degraded", "gesture is given up: it ended 6 times")
    assert account.notes == {"fusion": "fusion: started again 2 times; the last end, 12 s ago: killed by SIGKILL"}
    assert account.restarts == {"fusion": 2, "gesture": 5}
    assert account_of([well], 100.0).state == "ok"
    spare = Process("headpose newcomer", SLEEP, started=1, last_end="status 78", ended_s=70.0, once=True)
    said = "headpose newcomer: ended 30 s ago (status 78); it is not started again"
    assert account_of([spare], 100.0).notes == {"headpose newcomer": said}
