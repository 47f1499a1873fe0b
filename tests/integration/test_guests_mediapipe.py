"""The guests on MediaPipe: each keeps the contract, and all three together name what is pointed at."""

import json
import os
import subprocess
from concurrent.futures import ThreadPoolExecutor

import pytest
from deixis_runtime.lineups import guest_command, guests_of
from running import CLIP, POINTED_AT, SITE, command

STAGES = ("tracker", "headpose", "gesture")
OF_TIME = {"answers", "backlog", "silence", "starts"}
"""Checks that a machine too busy fails."""

pytestmark = pytest.mark.skipif(
    not all(os.access(guest_command(stage, "mediapipe"), os.X_OK) for stage in STAGES),
    reason="the guests on MediaPipe are not installed here: make guests",
)


def check(stage):
    start = f"{guest_command(stage, 'mediapipe')} --robot {{robot}} --connect {{connect}}"
    return subprocess.run(
        command("deixis", "check-stage", stage, "--command", start, "--json"),
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def not_passed(done):
    assert done.stdout, done.stderr[-3000:]
    return [item for item in json.loads(done.stdout)["checks"] if item["outcome"] != "passed"]


@pytest.fixture(scope="module")
def checked():
    """What check-stage says of each; at once, for most of its time is waiting."""
    with ThreadPoolExecutor(len(STAGES)) as pool:
        return dict(zip(STAGES, pool.map(check, STAGES), strict=True))


@pytest.mark.timeout(300)
@pytest.mark.parametrize("stage", STAGES)
def test_a_guest_keeps_the_contract(checked, stage):
    wrong = not_passed(checked[stage])
    if wrong and {item["name"] for item in wrong} <= OF_TIME:
        # Alone: models take their time, and three stages at once on a busy machine more than there is.
        wrong = not_passed(check(stage))
    assert wrong == []


@pytest.mark.timeout(240)
def test_the_guests_together_name_what_is_pointed_at(tmp_path, free_port):
    # Half of the clip's frames: twice as many say the same in twice the time.
    done = subprocess.run(
        command(
            "deixis", "run", CLIP, "--site", SITE, "--lineup", "mediapipe", "--lockstep", "--set", "camera.rate_hz=15",
            "--registry", tmp_path / "pois.sqlite", "--listen", f"tcp/127.0.0.1:{free_port}", "--json",
        ),
        capture_output=True, text=True, timeout=200, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    said = json.loads(done.stdout)
    assert [answer["poi_ids"] for answer in said["answers"]] == [[POINTED_AT]]
    weighed = {item["source"]: item for item in said["answers"][0]["evidence"]}
    assert all(item["weight"] > 0.1 for item in weighed.values()), weighed
    assert said["counters"].get("rejected", 0) == 0
    assert set(guests_of("mediapipe")) == set(STAGES)
