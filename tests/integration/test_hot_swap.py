"""A stage is replaced between two frames while a clip is played: exact counts, by listening to its key."""

import json
import signal
import subprocess
import sys

import pytest
from hot_swap_listener import Listener
from running import ROOT, command, process, system, tail, wait_until

SWAP = ROOT / "examples" / "swap_headpose.py"


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """The small clip through all stages, again and again, in lockstep: a busy machine drops no frame."""
    with system(tmp_path_factory.mktemp("swap"), "test-hot-swap") as it:
        it.wait_until(lambda: it.state().get("last_seq", -1) > 0, "frames to be answered", 60)
        yield it


def swap(running, *arguments, timeout=90):
    argv = command("deixis", "swap", *arguments, "--robot", running.robot, "--connect", running.endpoint, "--json")
    return subprocess.run(argv, capture_output=True, text=True, timeout=timeout, check=False)


def headpose_source(running):
    return next((source for source in running.state().get("sources", []) if source["stage"] == "headpose"), {})


def test_no_frame_is_lost_or_answered_twice_and_nobody_hears_two_voices(running):
    listener = Listener(running.session, running.robot)
    done = swap(running, "headpose", "--watch", "0.5")
    assert done.returncode == 0, done.stderr + tail(running.log)
    cost = json.loads(done.stdout)
    assert (cost["gap_frames"], cost["twice"], cost["unanswered"]) == (0, 0, 0)
    assert (listener.twice(), listener.unanswered()) == ({}, [])
    assert listener.order() == [cost["old"], cost["new"]]
    running.wait_until(
        lambda: headpose_source(running).get("producers") == [f"headpose/{cost['new']}"], "the new one in the state"
    )
    assert headpose_source(running)["status"] == "ok"
    assert "producer" not in " ".join(running.health("fusion")["notes"])
    assert "more than one producer" not in running.log.read_text()
    # The supervisor has it from now on.
    note = running.wait_until(lambda: running.health("supervisor").get("notes", []) == [], "nothing to be said of headpose")
    assert note


def test_a_stage_of_ones_own_takes_the_place_and_gives_it_back_when_its_command_ends(running, tmp_path):
    listener = Listener(running.session, running.robot)
    start = f"{sys.executable} {SWAP} --robot {{robot}} --connect {{connect}}"
    argv = ["swap", "headpose", "--command", start, "--watch", "0.5", "--robot", running.robot, "--connect", running.endpoint]
    log = tmp_path / "swap"
    with process(command("deixis", *argv), log) as child:
        wait_until(lambda: "runs here until Ctrl-C" in log.read_text() or child.poll() is not None, "the swap", 90, log)
        assert child.poll() is None, tail(log)
        old, guest = listener.order()
        assert guest.startswith("swap-")
        assert (listener.twice(), listener.unanswered()) == ({}, [])

        def evidence_of_the_guest():
            return [
                item
                for target in running.state().get("recent_targets", [])
                for item in target["evidence"]
                if item["source"] == "headpose" and item["producer"] == f"headpose/{guest}"
            ]

        running.wait_until(evidence_of_the_guest, "an answer that names the guest as the producer of its evidence", 90)
        child.send_signal(signal.SIGINT)
        assert child.wait(20) == 0, tail(log)
    again = running.wait_until(lambda: set(listener.instances()) - {old, guest}, "the supervisor's own headpose")
    assert listener.twice() == {}
    assert len(again) == 1


def test_a_command_that_ends_or_knows_nothing_of_standing_by_is_refused_and_the_old_one_keeps_the_place(running):
    listener = Listener(running.session, running.robot)
    ended = swap(running, "headpose", "--command", "false")
    assert ended.returncode == 1
    assert "the newcomer has ended (status 1); heard now: " in ended.stderr
    wrong = swap(running, "headpose", "--set", "no_such_setting=1")
    assert wrong.returncode == 1
    assert "the newcomer has ended (status 78; its message stands in the supervisor's log)" in wrong.stderr
    assert len(listener.instances()) == 1
    assert listener.unanswered() == []


def test_an_instance_that_has_the_place_or_is_not_there_is_said_at_once(running, tmp_path):
    old = running.wait_until(lambda: headpose_source(running).get("producers"), "a headpose")[0].removeprefix("headpose/")
    heard = swap(running, "headpose", "--instance", old, timeout=30)
    assert (heard.returncode, heard.stdout) == (1, "")
    assert f"{old} is headpose already" in heard.stderr
    argv = ["swap", "headpose", "--instance", "nobody", "--robot", running.robot, "--connect", running.endpoint]
    log = tmp_path / "swap"
    with process(command("deixis", *argv), log) as child:
        wait_until(lambda: "nobody does not stand by" in log.read_text() or child.poll() is not None, "a word", 30, log)
        assert child.poll() is None, tail(log)
        child.send_signal(signal.SIGINT)
        assert child.wait(20) == 1
    assert f"stopped; heard now: {old}" in log.read_text()
