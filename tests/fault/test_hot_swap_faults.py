"""A hot swap in which somebody dies or hangs: the place is not left empty, and no frame is answered twice."""

import os
import signal

import pytest
from hot_swap_listener import Listener, newcomer
from running import child_called, system, tail, wait_until


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    with system(tmp_path_factory.mktemp("swap"), "test-swap-faults") as it:
        it.wait_until(lambda: it.state().get("last_seq", -1) > 0, "frames to be answered", 60)
        yield it


def heard_now(listener):
    """Who has answered the last frame."""
    return listener.answers[-1][1] if listener.answers else None


def test_a_newcomer_that_dies_before_it_has_the_place_is_not_missed(running, tmp_path):
    listener = Listener(running.session, running.robot)
    with newcomer(tmp_path / "log", running.robot, running.endpoint, "early") as child:
        listener.await_state("early", "stands_by")
        child.kill()
        child.wait()
        count = len(listener.answers)
        wait_until(lambda: len(listener.answers) > count + 10, "frames to be answered", 30)
    assert (listener.twice(), listener.unanswered(), len(listener.order())) == ({}, [], 1)


def test_when_the_newcomer_dies_after_it_has_the_place_the_old_one_has_it_again(running, tmp_path):
    listener = Listener(running.session, running.robot)
    log = tmp_path / "log"
    with newcomer(log, running.robot, running.endpoint, "short") as child:
        listener.await_state("short", "stands_by")
        old = wait_until(lambda: heard_now(listener), "a frame", 30)
        assert listener.ask("short", f"?op=take;from={old}").state in ("asks", "speaks")
        wait_until(lambda: listener.by("short") > 5, "the newcomer to be heard", 30, log)
        assert listener.ask(old).state == "yields"
        assert "yields to short already" in listener.ask(old, "?op=yield;to=third")
        child.kill()
        child.wait()
        wait_until(lambda: heard_now(listener) == old, "the old one to be heard again", 30, running.log)
    assert listener.ask(old).state == "speaks"
    assert listener.order() == [old, "short", old]
    assert listener.twice() == {}
    assert len(listener.unanswered()) <= 8, "those in the tenth of a second until it was believed, and those in hand"


def test_an_old_one_that_hangs_when_it_is_asked_is_killed_and_the_newcomer_has_the_place(running, tmp_path):
    listener = Listener(running.session, running.robot)
    log = tmp_path / "log"
    with newcomer(log, running.robot, running.endpoint, "heir"):
        listener.await_state("heir", "stands_by")
        old = wait_until(lambda: heard_now(listener), "a frame", 30)
        os.kill(child_called(running.child.pid, "deixis-headpose"), signal.SIGSTOP)
        listener.ask("heir", f"?op=take;from={old}")
        # Whoever is first, its heir or the one that the supervisor starts in its place: the other one stands back.
        wait_until(lambda: heard_now(listener) not in (None, old), "another to be heard", 30, log)
        count = len(listener.answers)
        wait_until(lambda: len(listener.answers) > count + 20, "frames to be answered", 30)
        assert listener.twice() == {}, tail(running.log)
        assert len({who for _, who in listener.answers[count:]}) == 1
