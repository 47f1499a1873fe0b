"""`deixis check-stage` passes the stages that keep the contract, and names what the others break."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from xml.etree import ElementTree

import pytest
from running import BIN, ROOT, command, system

BROKEN = ROOT / "tests" / "broken_stage.py"
SMALL = ROOT / "examples" / "clips" / "small.mp4"
LOOPED = f"--set source={SMALL} --set loop=true"
OURS = {
    stage: f"{BIN}/deixis-{stage} --robot {{robot}} --connect {{connect}}"
    for stage in ("tracker", "headpose", "gesture", "fusion")
}
OURS["camera"] = f"{BIN}/deixis-camera --robot {{robot}} --connect {{connect}} {LOOPED}"
# What each broken stage is found out by.
FOUND_OUT = {
    "none": set(),
    "no_label": {"answers", "labels"},
    "broken_field": {"answers", "schema"},
    "twice": {"once"},
    "dies_of_garbage": {"garbage"},
    "works_off_a_queue": {"backlog"},
    "answers_the_old": {"age"},
    "ignores_sigterm": {"ends"},
    "chatters": {"silence"},
    "crashes": {"answers", "ends"},
}


def check(stage, start, *arguments):
    return subprocess.run(
        command("deixis", "check-stage", stage, "--command", start, *arguments),
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def at_once(jobs, workers):
    """The results of these checks by name; several run beside each other, for most of their time is waiting."""
    with ThreadPoolExecutor(workers) as pool:
        return dict(zip(jobs, pool.map(lambda job: check(*job), jobs.values()), strict=True))


@pytest.fixture(scope="module")
def of_broken():
    start = f"{sys.executable} {BROKEN} --robot {{robot}} --connect {{connect}} --defect"
    return at_once({name: ("gesture", f"{start} {name}", "--json") for name in FOUND_OUT}, 9)


def failed(done):
    return {item["name"]: item for item in json.loads(done.stdout)["checks"] if item["outcome"] == "failed"}


@pytest.mark.parametrize("defect", FOUND_OUT)
def test_a_stage_with_one_defect_fails_the_check_that_is_for_it(of_broken, defect):
    done = of_broken[defect]
    found = failed(done)
    assert done.returncode == (1 if FOUND_OUT[defect] else 0), done.stdout + done.stderr
    assert FOUND_OUT[defect] <= found.keys()
    assert all(item["advice"] for item in found.values()), "who fails is told what to do"


def test_what_is_found_names_the_cause(of_broken):
    assert "gestures.0.person_id" in failed(of_broken["broken_field"])["schema"]["found"]
    assert "expected 'application/msgpack;Gestures/" in failed(of_broken["no_label"])["labels"]["found"]
    crashed = failed(of_broken["crashes"])["ends"]["found"]
    assert "it ended by itself with status 1" in crashed
    assert "there is no model for this hand" in crashed


def test_our_own_stages_and_the_shortest_example_keep_the_contract():
    jobs = {stage: (stage, start, "--json") for stage, start in OURS.items()}
    own = f"{sys.executable} {ROOT / 'examples' / 'own_gesture.py'} --robot {{robot}} --connect {{connect}}"
    done = at_once(jobs | {"own": ("gesture", own, "--json")}, 6)
    for stage, result in done.items():
        assert result.returncode == 0, (stage, failed(result), result.stderr)


def test_the_report_is_for_people_for_programs_and_for_ci(tmp_path):
    junit = tmp_path / "report.xml"
    start = f"{sys.executable} {BROKEN} --robot {{robot}} --connect {{connect}} --defect ends_at_once"
    done = check("gesture", start, "--junit", junit)
    assert done.returncode == 1
    assert "WRONG starts: it ended with status 1: no model file" in done.stdout
    suite = ElementTree.parse(junit).getroot()
    assert (suite.get("failures"), suite.get("tests")) == ("1", "1")
    assert "no model file" in suite.find("testcase/failure").get("message")


def test_a_stage_in_a_running_system_is_only_watched(tmp_path, robot):
    with system(tmp_path, robot) as running:
        running.wait_until(lambda: running.health("gesture"), "gesture")
        done = subprocess.run(
            command("deixis", "check-stage", "gesture", "--robot", robot, "--connect", running.endpoint, "--json"),
            capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        outcomes = {item["name"]: item["outcome"] for item in json.loads(done.stdout)["checks"]}
        assert done.returncode == 0, done.stdout
        assert outcomes["answers"] == "passed"
        assert outcomes["garbage, age, backlog, runs"] == "skipped"
