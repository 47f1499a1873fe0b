"""A stage of one's own takes the place of ours, and two of them on one key are noticed."""

import json
import re
import subprocess
import sys

import pytest
from running import CLIP, POINTED_AT, ROOT, SMALL_POINTED_AT, command, free_port, process, system, wait_until

SWAP = ROOT / "examples" / "swap_headpose.py"
OWN = ROOT / "examples" / "own_gesture.py"


def producers(running):
    """Who publishes on the key of each stage, by fusion's state."""
    return {source["stage"]: source["producers"] for source in running.state().get("sources", [])}


@pytest.fixture
def swapped(tmp_path, robot):
    """The small clip through all stages but headpose, in whose place runs the example; gives (system, log of the example)."""
    with system(tmp_path, robot, "--except", "headpose") as running:
        log = tmp_path / "swap"
        with process([sys.executable, SWAP, "--robot", robot, "--connect", running.endpoint], log):
            yield running, log


def test_the_example_takes_the_place_of_headpose_and_each_evidence_names_its_producer(swapped):
    running, log = swapped

    def answers_with_the_swap():
        for target in running.state().get("recent_targets", []):
            evidence = {item["source"]: item for item in target["evidence"]}
            if evidence["headpose"]["producer"].startswith("headpose/swap-") and evidence["headpose"]["weight"] > 0:
                return target
        return None

    target = running.wait_until(answers_with_the_swap, "an answer that rests on the example's head pose", 120)
    evidence = {item["source"]: item for item in target["evidence"]}
    assert evidence["gesture"]["producer"] == "gesture/lockstep"
    assert re.search(r"yaw \d", evidence["headpose"]["observed"]), (
        "the head is turned to the person's left, which the example sees"
    )
    assert SMALL_POINTED_AT in target["poi_ids"], target["reason"]
    assert "Traceback" not in log.read_text()


def test_the_shortest_stage_takes_the_place_of_gesture_and_the_poi_is_named(tmp_path, robot):
    with system(tmp_path, robot, "--except", "gesture", clip=CLIP) as running:
        started = [sys.executable, OWN, "--robot", robot, "--connect", running.endpoint, "--lockstep", "--instance", "own"]
        with process(started, tmp_path / "own"):

            def answers_by_it():
                for target in running.state().get("recent_targets", []):
                    if any(item["producer"] == "gesture/own" and item["weight"] > 0 for item in target["evidence"]):
                        return target["poi_ids"]
                return None

            assert running.wait_until(answers_by_it, "an answer that rests on the example's gesture", 60) == [POINTED_AT]


def started_alone(log, robot, endpoint, *arguments):
    """The example, while no router listens at the endpoint."""
    return process([sys.executable, SWAP, "--robot", robot, "--connect", endpoint, *arguments], log)


def test_the_example_may_be_started_before_the_router_listens(tmp_path, robot):
    endpoint, log = f"tcp/127.0.0.1:{free_port()}", tmp_path / "swap"
    with started_alone(log, robot, endpoint):
        wait_until(lambda: "waiting 20 s for a router" in log.read_text(), "the example to miss the router", 20, log)
        with process([sys.executable, "-m", "deixis_runtime.router", "--listen", endpoint], tmp_path / "router"):
            wait_until(lambda: "alive as swap-" in log.read_text(), "the example to find the router", 20, log)


def test_without_a_router_the_example_ends_with_one_line_that_names_the_endpoint(tmp_path, robot):
    endpoint, log = f"tcp/127.0.0.1:{free_port()}", tmp_path / "swap"
    with started_alone(log, robot, endpoint, "--wait", "0.5") as child:
        assert child.wait(20) == 1
    assert log.read_text().splitlines()[1:] == [
        f"swap_headpose: no Zenoh router answers at {endpoint} (--connect); start 'deixis run' or 'deixis up'"
    ]


def test_two_producers_on_one_key_are_noticed_and_said(tmp_path, robot):
    with system(tmp_path, robot) as running:
        running.wait_until(lambda: producers(running).get("headpose"), "our head pose stage")
        with process([sys.executable, SWAP, "--robot", robot, "--connect", running.endpoint], tmp_path / "swap"):
            both = running.wait_until(lambda: len(found := producers(running)["headpose"]) == 2 and found, "both producers", 60)
            assert both[0] == "headpose/lockstep"
            assert both[1].startswith("headpose/swap-")
            notes = running.wait_until(
                lambda: [note for note in running.health("fusion")["notes"] if "producers" in note], "a word in fusion's health"
            )
            assert "headpose/lockstep" in notes[0]
            assert "headpose/swap-" in notes[0]
            doctor = subprocess.run(
                command("deixis", "doctor", "--robot", robot, "--connect", running.endpoint, "--json"),
                capture_output=True, text=True, timeout=60, check=False,
            )  # fmt: skip
            assert doctor.returncode != 0
            assert any("headpose" in finding["what"] and "swap-" in finding["what"] for finding in findings(doctor.stdout))


def findings(text):
    """What `deixis doctor --json` found wrong."""
    return [finding for finding in json.loads(text)["findings"] if finding["level"] == "wrong"]
