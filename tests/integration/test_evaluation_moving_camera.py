"""A clip labelled as if the robot had driven: its POIs are where fusion takes them to be only if it is told the way."""

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

DEIXIS = Path(sys.executable).parent / "deixis"
CLIP = "small"
ARRIVED = 12
"""Frame at which the robot stands where the camera really stood; the person points later."""
WAY_M, TURN_DEG = 0.9, 25.0


def view(label: dict[str, Any], share: float) -> dict[str, Any]:
    """The camera when the robot has this share of its way behind it: it comes from the right, turning to the left."""
    camera = label["meta"]["camera"]
    rotation = np.array(camera["R_world_to_cam"]).reshape(3, 3)
    centre = -rotation.T @ np.array(camera["t_world_to_cam"]) + [(1 - share) * WAY_M, 0, 0]
    yaw = math.radians((1 - share) * TURN_DEG)
    about_up = np.array([[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0], [-math.sin(yaw), 0, math.cos(yaw)]])
    turned = rotation @ about_up
    return {"R_world_to_cam": turned.ravel().tolist(), "t_world_to_cam": (-turned @ centre).tolist()}


def driven(clips: Path, folder: Path, *, told: bool) -> Path:
    """The clip in a folder of its own; `told`: with the camera's way in its frames."""
    folder.mkdir()
    shutil.copy(clips / f"{CLIP}.mp4", folder)
    label = json.loads((clips / f"{CLIP}.json").read_text())
    views = [view(label, min(1.0, index / ARRIVED)) for index in range(len(label["frames"]))]
    label["meta"]["camera"] |= views[0]
    if told:
        label["frames"] = [{**frame, "camera": seen} for frame, seen in zip(label["frames"], views, strict=True)]
    (folder / f"{CLIP}.json").write_text(json.dumps(label))
    return folder


def evaluate(folder: Path, out: Path, *more: str) -> dict[str, Any]:
    scores = out / "scores.json"
    command = [str(DEIXIS), "eval", str(folder), "--lockstep", "--out", str(out), "--json", str(scores), *more]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    content: dict[str, Any] = json.loads(scores.read_text())
    return content


def beliefs(path: Path) -> list[Any]:
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    return [line["message"]["persons"] for line in lines if line["type"] == "Belief"]


@pytest.mark.slow
def test_the_poses_of_a_driving_robot_make_the_answer_right_and_again_the_same(tmp_path: Path, clips: Path) -> None:
    folder = driven(clips, tmp_path / "told", told=True)
    first, second = (evaluate(folder, tmp_path / run)["clips"][CLIP]["episodes"] for run in ("first", "second"))
    assert [episode["outcome"] for episode in first] == ["named"]
    assert first == second
    assert beliefs(tmp_path / "first" / f"{CLIP}.jsonl") == beliefs(tmp_path / "second" / f"{CLIP}.jsonl")
    silent = evaluate(driven(clips, tmp_path / "silent", told=False), tmp_path / "third")
    assert [episode["outcome"] for episode in silent["clips"][CLIP]["episodes"]] != ["named"]


@pytest.mark.slow
def test_with_the_truth_in_place_of_all_stages_the_clip_is_named_and_says_so(tmp_path: Path, clips: Path) -> None:
    folder = driven(clips, tmp_path / "told", told=True)
    content = evaluate(folder, tmp_path / "out", "--truth", "headpose,gesture,tracker")
    assert content["truth"] == ["tracker", "headpose", "gesture"]
    assert content["summary"]["clips_named"] == 1
    assert content["summary"]["yaw"]["30-60"]["mae_deg"] == 0
    lines = [json.loads(line) for line in (tmp_path / "out" / f"{CLIP}.jsonl").read_text().splitlines()]
    producers = {
        (line["type"], line["message"]["instance"]) for line in lines if line["type"] in ("Tracks", "HeadPoses", "Gestures")
    }
    assert producers == {("Tracks", "truth"), ("HeadPoses", "truth"), ("Gestures", "truth")}
