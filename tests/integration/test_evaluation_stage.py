"""`deixis eval --stage STAGE` as a command, on short clips that ship."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from refused import refused

DEIXIS = Path(sys.executable).parent / "deixis"


def evaluate(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [str(DEIXIS), "eval", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_a_clip_is_scored_drawn_and_told_the_same_each_time(tmp_path: Path, clips: Path) -> None:
    told = []
    for name in ("first", "second"):
        out, scores = tmp_path / name, tmp_path / f"{name}.json"
        done = evaluate("--stage", "headpose", clips, "--only-clips", "small", "--out", out, "--json", scores)
        assert done.returncode == 0, done.stderr
        assert [path.name for path in out.iterdir()] == ["small.png"]
        told.append(json.loads(scores.read_text()))
    first, second = told
    assert first == second
    heads = first["clips"]["small"]["heads"]
    assert heads["frames"] == first["summary"]["frames"] == 63
    assert heads["answered"]["share"] > 0.9
    assert heads["yaw"]["mae_deg"] < 3
    assert heads["pitch"]["frames"] == heads["roll"]["frames"] == heads["status"]["tracking"]
    assert heads["silent_errors"]["hits"] == 0
    assert first["machine"]["cores"] >= 1
    assert "Head yaw, by true yaw" in done.stdout
    assert "small (1 of 1)" in done.stderr


def test_true_tracks_stand_in_and_settings_reach_the_stage(tmp_path: Path, clips: Path) -> None:
    scores = tmp_path / "scores.json"
    arguments = ("--stage", "headpose", clips, "--only-clips", "small", "--truth", "tracker", "--json", scores)
    done = evaluate(*arguments, "--set", "headpose.method=ellipsoid", "--set", "headpose.initial_views=30")
    assert done.returncode == 0, done.stderr
    content = json.loads(scores.read_text())
    assert content["truth"] == ["tracker"]
    assert content["settings"] == {"headpose": ["method=ellipsoid", "initial_views=30"]}
    status = content["summary"]["heads"]["status"]
    assert (status["absent"], status["initialising"] >= 29) == (0, True)


def test_a_clip_that_cannot_be_read_is_told_and_the_others_are_scored(tmp_path: Path, clips: Path) -> None:
    for name in ("a_good", "b_broken"):
        (tmp_path / f"{name}.json").write_bytes((clips / "small.json").read_bytes())
        (tmp_path / f"{name}.mp4").write_bytes((clips / "small.mp4").read_bytes() if name == "a_good" else b"no video")
    done = evaluate("--stage", "headpose", tmp_path, "--json", tmp_path / "out" / "scores.json")
    assert done.returncode == 1
    assert "1 of 2 clips were not played" in done.stderr
    summary = json.loads((tmp_path / "out" / "scores.json").read_text())["summary"]
    assert summary["failed"] == ["b_broken"]
    assert summary["heads"]["frames"] == 63


def test_gestures_and_fusion_are_scored_alone_and_a_table_with_an_empty_region_is_refused(tmp_path: Path, clips: Path) -> None:
    scores = {stage: tmp_path / f"{stage}.json" for stage in ("gesture", "fusion")}
    one = (clips, "--only-clips", "pointing")
    done = evaluate("--stage", "gesture", *one, "--json", scores["gesture"], "--confusion", tmp_path / "table.json")
    assert done.returncode == 1
    assert "no pointing was recognised to the left or center" in done.stderr
    (stroke,) = json.loads(scores["gesture"].read_text())["clips"]["pointing"]["strokes"]
    assert stroke["said"] == "point_right"
    assert stroke["probability"] > 0.8
    done = evaluate("--stage", "fusion", *one, "--json", scores["fusion"])
    assert done.returncode == 0, done.stderr
    summary = json.loads(scores["fusion"].read_text())["summary"]
    assert summary["outcomes"]["as they are"] == {"named": 1}
    assert summary["named_at_gap"]["30"]["of"] == 1


@pytest.mark.parametrize(
    ("arguments", "status", "named"),
    [
        (("--stage", "camera"), 2, "'camera' cannot be scored alone; known: headpose"),
        (("--stage", "gesture", "--truth", "headpose"), 1, "the truth can stand for tracker alone"),
        (("--stage", "fusion", "--set", "gesture.rules=paper"), 1, "only fusion can be set"),
        (("--stage", "fusion", "--confusion", "t.json"), 1, "goes with --stage gesture"),
        (("--stage", "nose"), 2, "'nose' cannot be scored alone; known: headpose"),
        (("--stage", "headpose", "--truth", "gesture"), 1, "the truth can stand for tracker alone"),
        (("--stage", "headpose", "--set", "fusion.x=1"), 1, "only tracker and headpose are played"),
        (("--stage", "headpose", "--seeds", "0:1"), 1, "either a folder"),
    ],
)
def test_bad_usage_gives_a_clear_error(
    clips: Path, arguments: tuple[str, ...], status: int, named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    became, said = refused(capsys, "eval", clips, *arguments)
    assert became == status
    assert named in said
    assert "Traceback" not in said
