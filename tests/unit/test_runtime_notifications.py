"""What children tell a supervisor, and that they end with it."""

import os
import socket
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from deixis_runtime.notifications import Notifications
from deixis_runtime.parent import SUPERVISED_BY, Parent
from deixis_runtime.procfs import Look, look_at, unable_s

CHILD = """
import os, sys, time
from deixis_runtime.manager import Manager
manager = Manager(os.environ)
for _ in range(int(sys.argv[1])):
    manager.tell(time.monotonic())
    time.sleep(0.02)
"""


@pytest.fixture
def notifications(tmp_path):
    with Notifications(tmp_path / "s", 0.2) as it:
        yield it


def test_a_child_is_heard_under_its_own_process_number(notifications, monkeypatch):
    monkeypatch.setenv("WATCHDOG_PID", "1")  # of our own manager: it is not the child's
    child = subprocess.Popen([sys.executable, "-c", CHILD, "20"], env=notifications.environment())
    heard = []
    while child.poll() is None:
        heard += notifications.senders()
        time.sleep(0.005)
    heard += notifications.senders()
    assert set(heard) == {child.pid}
    assert len(heard) > 4, "again and again, for its loop runs"


def test_other_datagrams_are_no_sign_and_a_flood_does_not_hold_us(notifications, tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.setblocking(False)
        for text in (b"READY=1", b"", b"x" * 4000, b"WATCHDOG=10"):
            sender.sendto(text, str(tmp_path / "s"))
        assert notifications.senders() == set()
        with suppress(BlockingIOError):  # until its queue is full
            for _ in range(10_000):
                sender.sendto(b"WATCHDOG=1", str(tmp_path / "s"))
    assert notifications.senders() == {os.getpid()}
    assert notifications.senders() == set()


def test_a_parent_that_ended_before_its_child_looked_is_gone():
    assert not Parent({}).gone()
    assert not Parent({SUPERVISED_BY: str(os.getppid())}).gone()
    assert Parent({SUPERVISED_BY: "4194304"}).gone()


@pytest.mark.parametrize(
    ("cpu_s", "wants", "expected"),
    [
        (0.0, True, 0.1),  # other work has the processor
        (0.1, True, 0.0),  # it runs: an endless loop, perhaps
        (0.04, True, 0.06),
        (0.0, False, 0.0),  # it was stopped, or waits for itself
        (0.3, True, 0.0),  # on several processors
    ],
)
def test_only_who_would_run_and_does_not_is_unable(cpu_s, wants, expected):
    assert unable_s(Look(5.0, False), Look(5.0 + cpu_s, wants), 0.1) == pytest.approx(expected)


def test_a_look_at_this_process_and_at_one_that_is_not_there():
    look = look_at(os.getpid())
    assert look is not None
    assert look.wants_to_run
    assert 0 < look.cpu_s < 10_000
    assert look_at(4194304) is None
