"""status, watch, doctor and poi on a running system."""

import json
import os
import pty
import re
import select
import signal
import subprocess
import time

import pytest
from deixis_schemas import codec
from running import command, system

ROBOT = "cli-test"
STAGES = ["camera", "tracker", "headpose", "gesture", "fusion"]


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """The small clip played again and again through all stages."""
    with system(tmp_path_factory.mktemp("system"), ROBOT) as it:
        it.wait_until(lambda: it.state().get("last_seq", -1) > 0, "answers", 60)
        yield it


@pytest.fixture
def ask(running):
    """Run `deixis ...` against the system; returns (status, stdout, stderr)."""

    def run(*argv, robot=ROBOT):
        words = command("deixis", *argv, "--robot", robot, "--connect", running.endpoint)
        ended = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
        assert "Traceback" not in ended.stderr
        return ended.returncode, ended.stdout, ended.stderr

    return run


def test_status_shows_all_stages_with_their_rates(ask):
    status, out, _ = ask("status", "--json")
    assert status == 0
    read = json.loads(out)
    assert [stage["stage"] for stage in read["stages"]] == STAGES
    assert {stage["state"] for stage in read["stages"]} <= {"ok", "degraded"}
    assert (read["missing"], read["doubled"], read["pois"]) == ([], [], 10)
    status, out, _ = ask("status")
    assert status == 0
    assert all(re.search(rf"^{stage} ", out, re.MULTILINE) for stage in STAGES)


def test_status_and_doctor_of_a_robot_that_is_not_there_say_so(ask):
    status, _, err = ask("status", robot="nobody")
    assert status == 1
    assert "knows no stage of robot 'nobody'" in err
    status, out, _ = ask("doctor", robot="nobody")
    assert status == 1
    assert "no stage of robot 'nobody' is alive" in out


@pytest.mark.parametrize("argv", [["status"], ["watch"], ["poi", "list"]])
def test_without_a_router_the_endpoint_is_named(argv, free_port):
    endpoint = f"tcp/127.0.0.1:{free_port}"
    words = command("deixis", *argv, "--robot", "r1", "--connect", endpoint)
    ended = subprocess.run(words, capture_output=True, text=True, timeout=30, check=False)
    assert ended.returncode == 1
    assert f"no Zenoh router answers at {endpoint}" in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1


def test_doctor_without_a_router_says_what_to_do(free_port):
    endpoint = f"tcp/127.0.0.1:{free_port}"
    words = command("deixis", "doctor", "--robot", "r1", "--connect", endpoint, "--json")
    ended = subprocess.run(words, capture_output=True, text=True, timeout=30, check=False)
    assert ended.returncode == 1
    read = json.loads(ended.stdout)
    assert read["wrong"] == 1
    assert endpoint in read["findings"][0]["what"]


def test_watch_prints_answers_as_json_lines(ask):
    status, out, _ = ask("watch", "--json", "--seconds", "4")
    assert status == 0
    read = [json.loads(line) for line in out.splitlines()]
    assert {line["type"] for line in read} <= {"Belief", "Target"}
    assert {"key", "type", "seq", "stamp_ns", "received_ns", "message"} == set(read[0])


def test_watch_on_a_terminal_draws_beliefs_and_stages_until_ctrl_c(running):
    argv = command("deixis", "watch", "--robot", ROBOT, "--connect", running.endpoint)
    pid, terminal = pty.fork()
    if pid == 0:
        os.execve(argv[0], argv, {**os.environ, "TERM": "xterm", "COLUMNS": "100", "LINES": "40"})
    drawn = read_until(terminal, "not known (mass)", 30)
    os.kill(pid, signal.SIGINT)
    drawn += read_until(terminal, None, 30)
    _, status = os.waitpid(pid, 0)
    assert os.waitstatus_to_exitcode(status) == 0
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", drawn)
    for stage in STAGES:
        assert re.search(rf"{stage} +(ok|-)", plain), plain[-2000:]
    assert "Traceback" not in drawn


def read_until(terminal, word, within_s):
    """What a program writes to its terminal until the word comes, or (None) until it ends."""
    text, until_s = "", time.monotonic() + within_s
    while time.monotonic() < until_s and (word is None or word not in text):
        ready, _, _ = select.select([terminal], [], [], 0.1)
        try:
            text += os.read(terminal, 65536).decode(errors="replace") if ready else ""
        except OSError:  # Linux' way to say that nobody holds the other side any more
            return text
    assert word is None or word in text, text[-2000:]
    return text


def test_watch_until_answer_prints_the_first_one_and_judges_it(ask, running):
    running.wait_until(lambda: running.state().get("recent_targets"), "an answer", 60)
    first = " or ".join(running.state()["recent_targets"][0]["poi_ids"])
    status, out, err = ask("watch", "--until-answer", "--seconds", "30", "--expect", first)
    assert (status, err) == (0, "")
    assert out.startswith("Person ")
    assert "conflict" in out
    status, _, err = ask("watch", "--until-answer", "--seconds", "30", "--expect", "P8")
    assert status == 1
    assert f"expected the one answer 'P8', but got: {first}" in err


def test_watch_until_answer_has_an_end_where_none_comes(ask):
    status, out, err = ask("watch", "--until-answer", "--seconds", "1", robot="nobody")
    assert (status, out) == (1, "")
    assert "no final answer came" in err


def test_a_reader_that_goes_away_is_no_crash(running):
    watch = " ".join(command("deixis", "watch", "--robot", ROBOT, "--connect", running.endpoint, "--json"))
    ended = subprocess.run(["sh", "-c", f"{watch} | head -n 1"], capture_output=True, text=True, timeout=30, check=False)
    assert ended.stdout.count("\n") == 1
    assert "Traceback" not in ended.stderr


def test_a_poi_is_added_moved_listed_and_removed_each_edit_acknowledged(ask, running):
    status, out, _ = ask("poi", "add", "lamp", "1", "-2.5", "0.75", "--name", "the lamp", "--tag", "light", "--json")
    (added,) = json.loads(out)
    lamp = {"poi_id": "lamp", "name": "the lamp", "position_m": [1.0, -2.5, 0.75], "extent_m": 0.5, "tags": ["light"]}
    assert (status, added | lamp, "@" in added["edited_by"]) == (0, added, True)
    assert added in running.state()["pois"]
    status, out, _ = ask("poi", "move", "lamp", "-1", "0", "2", "--by", "anna", "--json")
    (moved,) = json.loads(out)
    assert (status, moved["position_m"], moved["edited_by"]) == (0, [-1.0, 0.0, 2.0], "anna")
    assert moved["edited_ns"] > added["edited_ns"] > 0
    assert moved in json.loads(ask("poi", "list", "--json")[1])
    assert " anna the lamp [light]" in " ".join(ask("poi", "list")[1].split())
    assert ask("poi", "remove", "lamp")[0] == 0
    assert "lamp" not in {poi["poi_id"] for poi in running.state()["pois"]}


def test_editing_a_poi_that_is_not_there_is_an_error_that_names_it(ask):
    for action in (["remove", "nothing"], ["move", "nothing", "0", "0", "0"]):
        status, out, err = ask("poi", *action)
        assert (status, out) == (1, "")
        assert "nothing" in err


def test_import_takes_all_pois_of_a_file_or_none(ask, running, tmp_path):
    good = tmp_path / "good.yaml"
    good.write_text("- {poi_id: sofa, position_m: [1, 1, 0]}\n- {poi_id: shelf, position_m: [2, 1, 1], name: the shelf}\n")
    assert ask("poi", "import", str(good))[0] == 0
    assert {"sofa", "shelf"} <= {poi["poi_id"] for poi in running.state()["pois"]}
    bad = tmp_path / "bad.yaml"
    bad.write_text("- {poi_id: stool, position_m: [1, 1, 0]}\n- {poi_id: chair, position_m: [2, .nan, 1]}\n")
    status, _, err = ask("poi", "import", str(bad))
    assert status == 1
    assert "bad.yaml" in err
    assert "pois.1.position_m.1" in err
    assert "stool" not in {poi["poi_id"] for poi in running.state()["pois"]}
    for poi_id in ("sofa", "shelf"):
        assert ask("poi", "remove", poi_id)[0] == 0


def test_doctor_names_a_poi_edit_that_was_refused_and_changes_nothing_itself(ask, running):
    before = running.state()
    running.session.put(running.key("fusion/poi/lamp"), b'{"position_m": [1, "x", 0]}', encoding=codec.JSON)
    running.wait_until(lambda: running.state()["edits_rejected"] > before["edits_rejected"], "the refusal")
    _, out, _ = ask("doctor", "--json")
    said = [finding["what"] for finding in json.loads(out)["findings"]]
    assert any("fusion/poi/lamp was refused: position_m" in what for what in said)
    assert any("10 points of interest" in what for what in said)
    assert not any("does not reach" in what or "not heard by listening" in what for what in said)
    assert running.state()["edits_accepted"] == before["edits_accepted"]


def test_a_second_producer_of_a_stage_is_noticed_by_status(ask, running, wait_for):
    twin = command("deixis-gesture", "--robot", ROBOT, "--connect", running.endpoint, "--instance", "twin")
    with subprocess.Popen(twin, stderr=subprocess.DEVNULL) as child:
        try:
            wait_for(lambda: "gesture/twin" in ask("status", "--json")[1].replace('", "instance": "', "/"), "the twin")
            assert any("stage gesture has 2 producers" in line for line in json.loads(ask("status", "--json")[1])["doubled"])
        finally:
            child.terminate()


def test_a_stopped_stage_is_shown_as_hung_once_its_last_messages_are_forgotten(ask, running, wait_for):
    def state_of_twin():
        stages = json.loads(ask("status", "--json")[1])["stages"]
        return {f"{stage['stage']}/{stage['instance']}": stage["state"] for stage in stages}.get("gesture/stopped")

    # One that nobody supervises: a stopped stage of `deixis run` is soon killed and started again.
    twin = command("deixis-gesture", "--robot", ROBOT, "--connect", running.endpoint, "--instance", "stopped")
    with subprocess.Popen(twin, stderr=subprocess.DEVNULL) as child:
        try:
            wait_for(lambda: state_of_twin() == "ok", "the twin")
            child.send_signal(signal.SIGSTOP)
            wait_for(lambda: state_of_twin() == "hung", "the twin to be called hung")
        finally:
            child.kill()
