"""The player behind `deixis run`: real processes, a recording, and what it tells at the end."""

import json
import subprocess

import cv2
import numpy as np
import pytest
from deixis_cli.play import play
from deixis_runtime.host import HostOptions
from running import command

PICTURES = 12


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """A folder of small pictures, and a video of the same, whole and broken off."""
    folder = tmp_path_factory.mktemp("clip")
    (folder / "pictures").mkdir()
    writer = cv2.VideoWriter(str(folder / "clip.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 30, (96, 72))
    random = np.random.default_rng(1)
    for index in range(PICTURES):
        image = random.integers(0, 255, (72, 96, 3), np.uint8)
        cv2.imwrite(str(folder / "pictures" / f"{index:02}.png"), image)
        writer.write(image)
    writer.release()
    whole = (folder / "clip.avi").read_bytes()
    (folder / "broken.avi").write_bytes(whole[: len(whole) // 2])
    return folder


def options(robot, port, source, stages=("camera",), **more):
    sets = {"camera": (f"source={source}", "rate_hz=30")}
    return HostOptions(robot=robot, stages=stages, listen=(f"tcp/127.0.0.1:{port}",), sets=sets, **more)


def test_a_run_in_lockstep_loses_nothing_and_records_every_message(tmp_path, robot, free_port, pictures):
    heard = []
    stages = ("camera", "tracker", "headpose", "gesture", "fusion")
    setting = options(robot, free_port, pictures / "pictures", stages, lockstep=True)
    result = play(
        setting, out=tmp_path, name="clip", on_message=lambda key, message: heard.append((key, message)), timeout_s=90
    )
    assert result.failure is None
    assert result.frames == PICTURES
    assert result.counters["Belief"] == PICTURES
    assert result.counters["lost"] == result.counters["rejected"] == 0
    assert set(result.health) == set(stages)
    assert result.state.last_seq == PICTURES - 1
    lines = [json.loads(line) for line in (tmp_path / "clip.jsonl").read_text().splitlines()]
    assert len(lines) == len(heard)
    for path in ("camera/frame", "tracker/tracks", "headpose/poses", "gesture/gestures", "fusion/belief"):
        seqs = [line["seq"] for line in lines if line["key"] == f"deixis/{robot}/{path}"]
        assert seqs == list(range(PICTURES)), path
    assert all("data" not in line["message"] for line in lines if line["type"] == "Frame")
    assert all(line["received_ns"] > 1_600_000_000 * 10**9 for line in lines)


def test_a_run_of_some_stages_does_not_wait_for_the_others(robot, free_port, pictures):
    result = play(options(robot, free_port, pictures / "clip.avi"), timeout_s=60)
    assert result.failure is None
    assert result.camera.state == "ended"
    assert result.camera.last_seq == PICTURES - 1
    assert list(result.health) == ["camera"]


def test_a_run_that_does_not_end_is_ended_by_its_time(robot, free_port, pictures):
    endless = options(robot, free_port, pictures / "pictures")
    endless.sets["camera"] += ("loop=true",)
    result = play(endless, timeout_s=10)
    assert "has not ended" in result.failure


def test_a_recording_that_breaks_off_is_played_so_far_and_said(robot, free_port, pictures):
    result = play(options(robot, free_port, pictures / "broken.avi"), timeout_s=60)
    assert result.failure is not None
    assert "broken.avi" in result.failure


def test_run_prints_one_json_document_and_nothing_else(robot, free_port, pictures):
    argv = ["--robot", robot, "--listen", f"tcp/127.0.0.1:{free_port}", "--only", "camera", "--json"]
    ended = subprocess.run(
        command("deixis", "run", pictures / "pictures", *argv), capture_output=True, text=True, timeout=60, check=False
    )
    assert ended.returncode == 0, ended.stderr
    read = json.loads(ended.stdout)
    assert read["failure"] is None
    assert read["camera"]["state"] == "ended"
    assert read["answers"] == []


def test_an_output_folder_that_cannot_be_written_ends_the_run(tmp_path, robot, free_port, pictures):
    (tmp_path / "file").touch()
    result = play(options(robot, free_port, pictures / "pictures"), out=tmp_path / "file", timeout_s=60)
    assert "--out" in result.failure
    assert result.frames == 0
