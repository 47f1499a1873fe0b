"""`deixis eval` as a command: real processes on labelled clips made here, and on one that ships."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from deixis_evaluation.clips import load_clips
from deixis_evaluation.headpose_play import HeadposeSetup, play_heads
from deixis_evaluation.recording import read_recording

DEIXIS = Path(sys.executable).parent / "deixis"
FRAMES = 12


def empty_room(folder: Path, name: str) -> None:
    """A labelled clip in which nobody is: a noisy grey room."""
    random = np.random.default_rng(1)
    video = cv2.VideoWriter(str(folder / f"{name}.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), 30, (320, 240))
    assert video.isOpened()
    for _ in range(FRAMES):
        video.write(random.integers(90, 110, (240, 320, 3), dtype=np.uint8))
    video.release()
    camera = {
        "K": [[250, 0, 159.5], [0, 250, 119.5], [0, 0, 1]],
        "R_world_to_cam": [1, 0, 0, 0, -1, 0, 0, 0, -1],
        "t_world_to_cam": [0, 1.3, 2],
        "height_m": 1.3,
        "pitch_up_deg": 0,
    }
    meta = {"kind": "empty", "fps": 30, "width": 320, "height": 240, "camera": camera, "pois": []}
    frames = [{"frame": index, "persons": []} for index in range(FRAMES)]
    (folder / f"{name}.json").write_text(json.dumps({"meta": meta, "frames": frames}))


def evaluate(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [str(DEIXIS), "eval", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)


def test_an_empty_room_is_played_answered_and_scored(tmp_path: Path) -> None:
    empty_room(tmp_path, "empty")
    done = evaluate(tmp_path, "--lockstep", "--out", tmp_path / "out", "--json", tmp_path / "scores.json")
    assert done.returncode == 0, done.stderr
    scores = json.loads((tmp_path / "scores.json").read_text())
    assert scores["lockstep"] is True
    assert scores["machine"]["cores"] >= 1
    assert scores["clips"]["empty"]["failure"] is None
    assert scores["clips"]["empty"]["frames_answered"] == FRAMES
    assert scores["clips"]["empty"]["false_episodes"] == []
    assert scores["summary"]["quiet_clips"] == 1
    assert scores["summary"]["poi_named_share"] is None
    assert scores["summary"]["latency_ms"]["p95"] > 0
    lines = [json.loads(line) for line in (tmp_path / "out" / "empty.jsonl").read_text().splitlines()]
    assert {line["seq"] for line in lines if line["type"] == "Belief"} == set(range(FRAMES))
    assert "empty" in done.stdout
    assert "0 in 1 quiet clips" in done.stdout
    assert "empty (1 of 1)" in done.stderr


def test_a_clip_that_cannot_be_played_is_reported_and_the_others_are_scored(tmp_path: Path) -> None:
    empty_room(tmp_path, "a_good")
    empty_room(tmp_path, "b_broken")
    (tmp_path / "b_broken.mp4").write_bytes(b"no video")
    done = evaluate(tmp_path, "--lockstep", "--json", tmp_path / "scores.json")
    assert done.returncode == 1
    assert "1 of 2 clips were not played" in done.stderr
    scores = json.loads((tmp_path / "scores.json").read_text())
    assert scores["summary"]["failed"] == ["b_broken"]
    assert scores["clips"]["b_broken"]["failure"]
    assert scores["clips"]["a_good"]["frames_answered"] == FRAMES


@pytest.mark.parametrize("what", ["missing", "empty", "unlabelled", "bad label", "no folder for the scores"])
def test_what_cannot_be_scored_gives_one_clear_error(tmp_path: Path, what: str) -> None:
    folder, extra, named = tmp_path / "clips", [], {"missing": "is not a folder", "empty": "holds no clips"}.get(what, "")
    if what != "missing":
        folder.mkdir()
    if what in ("unlabelled", "bad label", "no folder for the scores"):
        empty_room(folder, "clip")
    if what == "unlabelled":
        (folder / "clip.json").unlink()
        named = "no label file clip.json"
    if what == "bad label":
        (folder / "clip.json").write_text('{"meta": {"kind": 1}}')
        named = "clip.json': meta.kind"
    if what == "no folder for the scores":
        (tmp_path / "file").write_text("")
        extra, named = ["--json", str(tmp_path / "file" / "scores.json")], "--json"
    done = evaluate(folder, *extra)
    assert done.returncode == 1
    assert named in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def outputs(path: Path) -> list[Any]:
    """All messages but health, by key and frame, without the time of receipt. Stages answer a frame at the same time."""
    kept = []
    for line in path.read_text().splitlines():
        entry = json.loads(line)
        if entry["type"] != "Health":
            entry.pop("received_ns")
            kept.append(entry)
    order = {key: index for index, key in enumerate(sorted({entry["key"] for entry in kept}))}
    return sorted(kept, key=lambda entry: order[entry["key"]])


def test_two_lockstep_runs_of_a_clip_give_equal_outputs_and_cores_alone_equal_heads(tmp_path: Path, clips: Path) -> None:
    for run in ("first", "second"):
        done = evaluate(clips, "--lockstep", "--only-clips", "small", "--out", tmp_path / run)
        assert done.returncode == 0, done.stderr
    first, second = (outputs(tmp_path / run / "small.jsonl") for run in ("first", "second"))
    assert sum(entry["type"] == "Belief" for entry in first) == 63
    assert sum(entry["type"] == "Target" and entry["message"]["final"] for entry in first) == 1
    assert first == second
    whole = read_recording(tmp_path / "first" / "small.jsonl")
    alone = play_heads(load_clips(clips, "small")[0], HeadposeSetup())
    assert [alone.poses_at(frame) for frame in range(63)] == [whole.poses_at(frame) for frame in range(63)]
