"""What a supervisor does with the two processes of a place: who is kept, who is started again, who is stopped."""

import sys
import time

import pytest
from deixis_runtime.newcomers import GONE_S, MAX_SETS, STANDS_BY_S, Newcomers, newcomer_of, settings_of
from deixis_runtime.queries import Refused
from deixis_runtime.stage import EXIT_REPLACED
from deixis_runtime.supervisor import Supervisor, say_status
from deixis_runtime.supervisor_health import account_of

SLEEP = [sys.executable, "-c", "import time; time.sleep(60)"]
LEAVE = [sys.executable, "-c", f"raise SystemExit({EXIT_REPLACED})"]
NEWCOMER = newcomer_of("headpose")


@pytest.fixture
def supervisor():
    it = Supervisor()
    yield it
    it.stop()


@pytest.fixture
def newcomers(supervisor):
    return Newcomers(supervisor, lambda _stage: SLEEP, lambda pid: f"host-{pid}")


def until_ended(supervisor, name):
    supervisor.processes[name].popen.wait(20)
    supervisor.poll()


def replaced(supervisor):
    """A headpose that has yielded its place and ended."""
    supervisor.start("headpose", LEAVE)
    until_ended(supervisor, "headpose")
    process = supervisor.processes["headpose"]
    assert process.replaced
    assert process.last_end == say_status(EXIT_REPLACED) == "replaced by another process"
    return process


def test_who_was_replaced_is_not_started_again_while_another_has_its_place(supervisor, newcomers):
    process = replaced(supervisor)
    for now_s in (0.0, GONE_S, 10 * GONE_S):
        newcomers.look({("headpose", "guest")}, now_s)
        supervisor.poll()
    assert not process.running
    assert process.started == 1
    assert "another process has its place" in account_of(supervisor.processes.values(), time.monotonic()).notes["headpose"]


def test_it_is_started_again_when_nobody_has_had_the_place_for_a_moment(supervisor, newcomers):
    process = replaced(supervisor)
    process.argv = SLEEP
    newcomers.look({("headpose", "guest")}, 0.0)
    newcomers.look({("tracker", "other")}, 1.0)
    newcomers.look(set(), 1.0 + GONE_S / 2)
    assert not process.running
    newcomers.look(set(), 1.0 + GONE_S)
    assert process.running
    assert not process.replaced


def test_a_newcomer_that_has_the_place_is_its_supervisors_own_from_then_on(supervisor, newcomers):
    supervisor.start("headpose", SLEEP)
    instance = newcomers.start("headpose", ("method=affine",), "router")
    process = supervisor.processes[NEWCOMER]
    assert instance == f"host-{process.popen.pid}"
    assert process.argv[-3:] == ["--set", "method=affine", "--stand-by"]
    supervisor.processes["headpose"].popen.kill()
    supervisor.processes["headpose"].popen.wait()
    supervisor.processes["headpose"].replaced = True
    newcomers.look({("headpose", instance)}, 0.0)
    assert supervisor.processes == {"headpose": process}
    assert process.argv[-2:] == ["--set", "method=affine"], "what is started again does not stand by"
    assert not process.once


def test_a_newcomer_that_ends_is_not_started_again_and_its_end_is_told(supervisor, newcomers):
    supervisor.start("headpose", SLEEP)
    newcomers.start("headpose", (), "router")
    supervisor.processes[NEWCOMER].popen.kill()
    until_ended(supervisor, NEWCOMER)
    supervisor.poll()
    assert not supervisor.processes[NEWCOMER].running
    with pytest.raises(Refused, match="killed by SIGKILL; its message stands in the supervisor's log"):
        newcomers.instance("headpose")
    assert newcomers.start("headpose", (), "router"), "another may come"


def test_a_newcomer_that_nobody_gives_the_place_is_stopped_after_a_while_and_one_that_has_it_is_not(supervisor, newcomers):
    supervisor.start("headpose", SLEEP)
    instance = newcomers.start("headpose", (), "router")
    late_s = supervisor.processes[NEWCOMER].started_s + STANDS_BY_S + 1
    newcomers.look({("headpose", instance)}, late_s)
    assert NEWCOMER in supervisor.processes
    newcomers.look({("headpose", "old")}, late_s)
    assert NEWCOMER not in supervisor.processes


def test_what_cannot_be_started_is_refused_with_the_reason(supervisor, newcomers):
    with pytest.raises(Refused, match="'headpose' is not started here"):
        newcomers.start("headpose", (), "router")
    supervisor.start("headpose", SLEEP)
    supervisor.start("fusion", SLEEP)
    newcomers.start("headpose", (), "router")
    with pytest.raises(Refused, match="a newcomer of headpose stands by already"):
        newcomers.start("headpose", (), "router")
    with pytest.raises(Refused, match="'fusion' is not started here"):
        newcomers.start("fusion", (), "router")


def test_one_that_has_the_place_is_not_stopped(supervisor, newcomers):
    supervisor.start("headpose", SLEEP)
    instance = newcomers.start("headpose", (), "router")
    with pytest.raises(Refused, match="has the place by now"):
        newcomers.stop("headpose", {("headpose", instance)})
    assert newcomers.stop("headpose", set()) == instance
    assert NEWCOMER not in supervisor.processes


def test_settings_come_as_a_bounded_list_of_texts():
    assert settings_of(None) == settings_of(b"[]") == ()
    assert settings_of(b'["a=1", "b=2"]') == ("a=1", "b=2")
    for payload in (
        b"{",
        b"{}",
        b"[1]",
        b'["' + b"x" * 600 + b'"]',
        str(["a"] * (MAX_SETS + 1)).replace("'", '"').encode(),
        b"[" * 9999,
    ):
        with pytest.raises(Refused, match="payload"):
            settings_of(payload)
