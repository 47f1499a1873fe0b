"""`deixis simulate`: real clips, tiny ones."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import cv2
import pytest
import yaml
from deixis_evaluation.clips import load_clips
from deixis_simulation.draw import draw_scene
from deixis_simulation.scene import Camera, dump_scene
from refused import refused
from simulation_ready import needs_renderer

DEIXIS = Path(sys.executable).parent / "deixis"


def simulate(*arguments, timeout_s=100):
    command = [str(DEIXIS), "simulate", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)


def tiny(seed, index, kinds=("point",), duration_s=0.25, size=(240, 180)):
    """A drawn scene, small and short; what would be done later is left out."""
    scene = draw_scene(seed, index, kinds)
    camera = scene.camera.model_copy(update={"width": size[0], "height": size[1]})
    return scene.model_copy(update={"duration_s": duration_s, "camera": Camera.model_validate(camera.model_dump())})


def written(scene, folder, name):
    path = folder / f"{name}.yaml"
    path.write_text(dump_scene(scene))
    return path


def frames(video):
    capture, pictures = cv2.VideoCapture(str(video)), []
    while True:
        there, picture = capture.read()
        if not there:
            return pictures
        pictures.append(picture.tobytes())


def test_dry_run_writes_scenes_that_can_be_read(tmp_path):
    done = simulate("--dry-run", "--count", 2, "--seed", 4, "--kinds", "turn", "--out", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["s0004_000_turn.yaml", "s0004_001_turn.yaml"]
    shown = simulate("--dry-run", "--seed", 4, "--kinds", "turn")
    assert shown.stdout == (tmp_path / "s0004_000_turn.yaml").read_text()


def test_plain_scenes_have_names_of_their_own(tmp_path, capsys):
    done = simulate("--dry-run", "--plain", "--count", 2, "--seed", 4, "--kinds", "turn", "--out", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["p0004_000_turn.yaml", "p0004_001_turn.yaml"]
    status, complaint = refused(capsys, "simulate", "--dry-run", "--plain", "--size", "1280x720")
    assert status == 1
    assert "4:3" in complaint


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--size", "640"), "not a size"),
        (("--size", "100x100"), "160x120"),
        (("--size", "640x200"), "16:9"),
        (("--fov", "90-50"), "lower first"),
        (("--kinds", "point,dance"), "'dance' is none of"),
        (("--count", "0"), "not within"),
        (("--jobs", "many"), "not a whole number"),
    ],
)
def test_bad_options_are_usage_errors(arguments, said, capsys):
    status, complaint = refused(capsys, "simulate", *arguments)
    assert status == 2
    assert said in complaint


def test_rendering_needs_a_folder(capsys):
    status, complaint = refused(capsys, "simulate", "--count", 1)
    assert status == 1
    assert "--out" in complaint


def test_a_bad_scene_names_its_field(tmp_path, capsys):
    content = yaml.safe_load(dump_scene(draw_scene(1, 0, ("point",))))
    content["people"][0]["place"] = [1, 2]
    (tmp_path / "bad.yaml").write_text(yaml.safe_dump(content))
    status, complaint = refused(capsys, "simulate", "--scene", tmp_path / "bad.yaml", "--out", tmp_path)
    assert status == 1
    assert "people.0.place" in complaint
    assert "bad.yaml" in complaint


def test_a_scene_that_is_not_there(tmp_path, capsys):
    status, complaint = refused(capsys, "simulate", "--scene", tmp_path / "none.yaml", "--out", tmp_path)
    assert status == 1
    assert "cannot be read" in complaint


@needs_renderer
def test_a_clip_is_the_same_from_its_own_json_and_by_any_number_of_jobs(tmp_path):
    from deixis_simulation.jobs import render_all

    scenes = [tiny(3, index) for index in range(2)]
    one, two = tmp_path / "one", tmp_path / "two"
    assert render_all(scenes, one, jobs=1).rendered == [scene.name for scene in scenes]
    assert sorted(render_all(scenes[::-1], two, jobs=2, labels=True).rendered) == [scene.name for scene in scenes]
    for scene in scenes:
        assert (one / f"{scene.name}.json").read_bytes() == (two / f"{scene.name}.json").read_bytes()
        assert (one / f"{scene.name}.mp4").read_bytes() == (two / f"{scene.name}.mp4").read_bytes()
        assert (two / f"{scene.name}_labels.npz").is_file()
    assert not list(one.glob(".unfinished*"))

    again = tmp_path / "again"
    done = simulate("--scene", one / f"{scenes[0].name}.json", "--out", again)
    assert done.returncode == 0, done.stderr
    assert (again / f"{scenes[0].name}.mp4").read_bytes() == (one / f"{scenes[0].name}.mp4").read_bytes()
    assert len(frames(again / f"{scenes[0].name}.mp4")) == 8
    assert [len(clip.truth.frames) for clip in load_clips(one)] == [8, 8]


@needs_renderer
def test_finished_clips_are_skipped_and_changed_ones_are_not(tmp_path):
    scene = written(tiny(3, 0, duration_s=0.1, size=(160, 120)), tmp_path, "mine")
    out = tmp_path / "out"
    first = simulate("--scene", scene, "--out", out)
    assert "1 clips rendered" in first.stdout, first.stderr
    before = (out / "mine.mp4").stat().st_mtime_ns
    second = simulate("--scene", scene, "--out", out)
    assert "1 were there already" in second.stdout
    assert (out / "mine.mp4").stat().st_mtime_ns == before
    content = yaml.safe_load(scene.read_text())
    content["people"][0]["height_m"] = 1.3
    scene.write_text(yaml.safe_dump(content))
    assert "1 clips rendered" in simulate("--scene", scene, "--out", out).stdout
    assert json.loads((out / "mine.json").read_text())["meta"]["persons"][0]["height_m"] == 1.3


@needs_renderer
def test_an_interrupt_leaves_what_is_finished_and_nothing_else(tmp_path):
    command = [
        str(DEIXIS),
        "simulate",
        "--count",
        "50",
        "--seed",
        "6",
        "--size",
        "160x120",
        "--jobs",
        "1",
        "--out",
        str(tmp_path),
    ]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 40
    while not list(tmp_path.glob(".unfinished*/*")) and time.monotonic() < deadline:
        time.sleep(0.1)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=20)
    assert running.returncode == 130
    assert "clips are finished" in said
    assert not list(tmp_path.glob(".unfinished*"))
    assert {path.stem for path in tmp_path.glob("*.mp4")} == {path.stem for path in tmp_path.glob("*.json")}
