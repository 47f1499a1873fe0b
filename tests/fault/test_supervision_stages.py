"""Stages that are misconfigured or given up, under `deixis up` and `deixis run`; killed ones: test_supervision_faults."""

import json
import os
import signal
import subprocess
import time
import uuid
from contextlib import contextmanager

import cv2
import numpy as np
import pytest
from deixis_cli.gets import get_healths
from deixis_runtime.session import open_client
from running import answers, child_called, command, free_port, get_one, process, tail, wait_until

STAGES = "camera,fusion"  # the two that start quickest


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """A folder of small pictures to play."""
    folder = tmp_path_factory.mktemp("pictures")
    for index in range(5):
        cv2.imwrite(str(folder / f"{index}.png"), np.full((72, 96, 3), 40 * index, np.uint8))
    return folder


@pytest.fixture
def endpoint(free_port):
    return f"tcp/127.0.0.1:{free_port}"


@pytest.fixture
def up(tmp_path, pictures):
    """A system that the test may end."""
    with running_up(tmp_path, pictures) as it:
        yield it


@contextmanager
def running_up(folder, pictures):
    """`deixis up` of camera and fusion on the pictures, again and again; with a session of ours."""
    robot, endpoint, log = f"test-{uuid.uuid4().hex[:8]}", f"tcp/127.0.0.1:{free_port()}", folder / "log"
    with process(up_command(robot, endpoint, pictures), log) as child:
        wait_until(lambda: child.poll() is not None or answers(endpoint), "a router", 30, log)
        assert child.poll() is None, tail(log)
        with open_client(endpoint, shared_memory=False) as session:
            it = Up(child, log, robot, endpoint, session)
            wait_until(lambda: it.health("camera"), "the camera, the last to start", 30, log)
            yield it


def up_command(robot, endpoint, pictures, *arguments):
    options = ["--robot", robot, "--listen", endpoint, "--only", STAGES]
    camera = ["--set", f"camera.source={pictures}", "--set", "camera.loop=true", "--set", "camera.rate_hz=20"]
    return command("deixis", "up", *options, *camera, *arguments)


class Up:
    def __init__(self, child, log, robot, endpoint, session):
        self.child, self.log, self.robot, self.endpoint, self.session = child, log, robot, endpoint, session

    def health(self, stage):
        """The stage's health as it answers now; None while it does not."""
        answers = [health for health in get_healths(self.session, self.robot, 1.0) if health.stage == stage]
        return answers[0] if answers else None

    def frames(self):
        health = self.health("camera")
        return sum(item.published for item in health.outputs if item.key.endswith("/camera/frame")) if health else 0


def give_up(supervisor, stage, log):
    """Kill a stage each time it is started, until the supervisor gives it up."""
    while f"{stage} is given up" not in log.read_text():
        pid = child_called(supervisor, f"deixis-{stage}")
        if pid is not None:
            os.kill(pid, signal.SIGKILL)
        time.sleep(0.1)


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("fusion.no_such_setting=1", "no_such_setting: unknown key"),
        ("camera.quality=1000", "settings of camera: quality"),
        ("camera.source", "not of the form STAGE.NAME=VALUE"),
    ],
)
def test_wrong_settings_end_the_run_with_one_clear_error(setting, said, robot, endpoint, pictures):
    argv = command("deixis", "run", pictures, "--robot", robot, "--listen", endpoint, "--only", STAGES, "--set", setting)
    ended = subprocess.run(argv, capture_output=True, text=True, timeout=30, check=False)
    assert ended.returncode == 1
    assert said in ended.stderr
    assert ended.stderr.count(said) == 1
    assert "Traceback" not in ended.stderr


def test_a_taken_port_is_said_with_the_way_out(up, robot, pictures):
    endpoint = up.endpoint
    argv = command("deixis", "run", pictures, "--robot", robot, "--listen", endpoint, "--only", "camera")
    ended = subprocess.run(argv, capture_output=True, text=True, timeout=30, check=False)
    assert ended.returncode == 1
    assert "cannot listen on" in ended.stderr
    assert endpoint in ended.stderr
    assert "Choose --listen" in ended.stderr
    assert up.child.poll() is None


def test_a_missing_source_is_said_before_anything_starts(robot, endpoint):
    argv = command("deixis", "run", "nowhere.mp4", "--robot", robot, "--listen", endpoint)
    ended = subprocess.run(argv, capture_output=True, text=True, timeout=10, check=False)
    assert ended.returncode == 1
    assert len(ended.stderr.splitlines()) == 1
    assert "nowhere.mp4': no such file or folder" in ended.stderr
    assert not answers(endpoint)


def test_a_source_that_is_no_video_ends_the_run_with_its_cause(tmp_path, robot, endpoint):
    (tmp_path / "notes.mp4").write_bytes(b"this is not a video\n" * 50)
    argv = command(
        "deixis", "run", tmp_path / "notes.mp4", "--robot", robot, "--listen", endpoint, "--only", "camera", "--json"
    )
    ended = subprocess.run(argv, capture_output=True, text=True, timeout=30, check=False)
    assert ended.returncode == 1
    assert "deixis run: " in ended.stderr
    assert "notes.mp4" in ended.stderr


@pytest.mark.slow
def test_a_stage_that_is_given_up_degrades_the_system_and_the_run_says_so_at_its_end(tmp_path, robot, endpoint, pictures):
    log = tmp_path / "log"
    argv = command("deixis", "run", pictures, "--robot", robot, "--listen", endpoint, "--only", "camera,fusion,gesture")
    argv += ["--json", "--set", "camera.rate_hz=0.2", "--registry", str(tmp_path / "pois.sqlite")]
    with log.open("wb") as file, subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=file) as run:
        try:
            wait_until(lambda: answers(endpoint), "a router", 30, log)
            with open_client(endpoint, shared_memory=False) as session:
                key = f"deixis/{robot}/camera/info"
                wait_until(lambda: (info := get_one(session, key)) and info["state"] == "streaming", "frames", 30, log)
            give_up(run.pid, "gesture", log)
            out, _ = run.communicate(timeout=40)
        finally:
            run.kill()
    read = json.loads(out)
    assert run.returncode == 1
    assert read["failure"].startswith("gesture is given up: it ended")
    assert read["camera"]["state"] == "ended", "it was played to its end"
    assert read["frames"] == 5
    assert log.read_text().count("gesture is given up") == 2, "logged once, and told at the end"


@pytest.mark.slow
def test_a_camera_that_is_given_up_ends_the_run_for_nothing_comes_any_more(tmp_path, robot, endpoint, pictures):
    log = tmp_path / "log"
    argv = command("deixis", "run", pictures, "--robot", robot, "--listen", endpoint, "--only", "camera,gesture", "--loop")
    with process(argv, log) as run:
        wait_until(lambda: "streaming" in log.read_text(), "frames", 30, log)
        give_up(run.pid, "camera", log)
        assert run.wait(20) == 1
    assert "deixis run: camera is given up: it ended" in log.read_text()


@pytest.mark.slow
def test_up_goes_on_without_a_stage_that_is_given_up_and_ends_when_none_is_left(up):
    give_up(up.child.pid, "fusion", up.log)
    before = up.frames()
    wait_until(lambda: up.frames() > before + 5, "the camera goes on", 10, up.log)
    supervisor = up.health("supervisor")
    assert supervisor.state == "degraded"
    assert supervisor.reason == "fusion is given up: it ended 6 times within 60 s, the last time: killed by SIGKILL"
    assert up.child.poll() is None
    give_up(up.child.pid, "camera", up.log)
    assert up.child.wait(10) == 1
