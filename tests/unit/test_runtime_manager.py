"""What a process tells the one that manages it."""

import socket

import pytest
from deixis_runtime.manager import Manager, Unheard, message


@pytest.fixture
def heard(tmp_path):
    """A manager's socket, and what came to it."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as bound:
        bound.bind(str(tmp_path / "notify"))
        bound.setblocking(False)
        yield bound


def all_of(heard):
    lines = []
    while True:
        try:
            lines.append(heard.recv(4096).decode().split("\n"))
        except BlockingIOError:
            return lines


def environment(heard, **more):
    return {"NOTIFY_SOCKET": heard.getsockname(), **more}


def test_the_first_turn_says_ready_and_later_ones_alive_when_due(heard):
    manager = Manager(environment(heard, WATCHDOG_USEC="2000000"))
    for now_s in (10.0, 10.1, 10.4, 10.5, 10.6, 11.2):
        manager.tell(now_s, "ok")
    assert all_of(heard) == [["READY=1", "WATCHDOG=1", "STATUS=ok"], *[["WATCHDOG=1", "STATUS=ok"]] * 2]


def test_a_manager_that_does_not_watch_hears_once(heard):
    manager = Manager(environment(heard))
    for now_s in (0.0, 1.0, 100.0):
        manager.tell(now_s)
    assert all_of(heard) == [["READY=1", "WATCHDOG=1"]]


def test_the_watch_over_another_process_is_not_ours(heard):
    manager = Manager(environment(heard, WATCHDOG_USEC="2000000", WATCHDOG_PID="1"))
    manager.tell(0.0)
    manager.tell(9.0)
    assert len(all_of(heard)) == 1


def test_an_abstract_name_is_reached():
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as bound:
        bound.bind("")
        Manager({"NOTIFY_SOCKET": "@" + bound.getsockname()[1:].decode()}).tell(0.0)
        assert bound.recv(100) == b"READY=1\nWATCHDOG=1"


def test_a_manager_that_is_gone_is_an_error(tmp_path):
    with pytest.raises(Unheard, match=r"NOTIFY_SOCKET: nobody hears .*: No such file"):
        Manager({"NOTIFY_SOCKET": str(tmp_path / "none")}).tell(0.0)


def test_the_watchman_is_told_five_times_a_second_however_patient_the_manager_is(heard):
    manager = Manager({"DEIXIS_WATCHMAN": heard.getsockname(), "WATCHDOG_USEC": "10000000"})
    for turn in range(11):
        manager.tell(20.0 + turn / 10)
    assert len(all_of(heard)) == 6


def test_a_watchman_that_is_gone_keeps_no_sign_from_the_manager_and_is_said(heard, tmp_path):
    manager = Manager(environment(heard, DEIXIS_WATCHMAN=str(tmp_path / "none"), WATCHDOG_USEC="2000000"))
    for now_s in (0.0, 1.0):
        with pytest.raises(Unheard, match=r"^DEIXIS_WATCHMAN: nobody hears"):
            manager.tell(now_s)
    assert len(all_of(heard)) == 2


def test_who_leaves_tells_the_watchman_and_then_nobody(heard):
    manager = Manager({"DEIXIS_WATCHMAN": heard.getsockname()})
    manager.leave()
    manager.leave()
    manager.tell(0.0)
    assert all_of(heard) == [["STOPPING=1"]]


def test_who_leaves_says_nothing_to_systemd_which_knows(heard):
    Manager(environment(heard)).leave()
    assert all_of(heard) == []


def test_without_a_manager_nothing_happens():
    Manager({}).tell(0.0)


def test_a_status_is_one_line():
    assert message(first=False, status="no\nREADY=1 link") == b"WATCHDOG=1\nSTATUS=no READY=1 link"
