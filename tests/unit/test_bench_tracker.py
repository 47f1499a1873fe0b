"""The benchmark of the tracker's cost: times of steps, what is compared, and what is said of what is not there."""

import json
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def bench(monkeypatch):
    """The benchmarks' folder, as for `python bench/tracker.py`."""
    monkeypatch.syspath_prepend(str(ROOT / "bench"))


def spend(ms):
    until_ns = time.process_time_ns() + round(ms * 1e6)
    while time.process_time_ns() < until_ns:
        pass


def test_the_time_of_a_step_is_its_own():
    from tracker_steps import Stopwatch

    watch = Stopwatch()
    inner = watch.wrap("inner", lambda: spend(20))
    watch.wrap("outer", lambda: (spend(5), inner(), spend(5)))()
    assert 10 <= watch.spent_ns["outer"] / 1e6 < 18
    assert 20 <= watch.spent_ns["inner"] / 1e6 < 28


def test_each_step_is_found_in_the_code():
    from tracker_steps import PACKAGE, STEPS

    for part in (part for parts in STEPS.values() for part in parts):
        module, _, name = part.partition(".")
        held = sys.modules[f"{PACKAGE}.{module}"]
        for attribute in name.split("."):
            held = getattr(held, attribute)
        assert callable(held), part


def answer(cpu_ms, **others):
    return {"clips/one.mp4": {"cpu_ms": cpu_ms, "faces": 1.0, "hands": 2.0, **others}}


def test_figures_are_flat_and_ratios_tell_how_many_times_as_long_others_take():
    from tracker import figures_of

    ours = answer(5.0, steps={"finder's network": 2.0, "other": 3.0}, digest="a")
    best = {
        "tracker": ours,
        "beside": answer(10.0, digest="b"),
        "mediapipe": answer(40.0, cpu_ms_faces=8.0, cpu_ms_hands=32.0),
    }
    assert figures_of(best) == {
        "cpu_ms_one": 5.0,
        "cpu_ms_one_finders_network": 2.0,
        "cpu_ms_one_other": 3.0,
        "beside_cpu_ms_one": 10.0,
        "beside_ratio_one": 2.0,
        "beside_same_one": 0.0,
        "mediapipe_cpu_ms_one": 40.0,
        "mediapipe_cpu_ms_one_faces": 8.0,
        "mediapipe_cpu_ms_one_hands": 32.0,
        "mediapipe_ratio_one": 8.0,
    }


def test_a_short_clip_is_measured_beside_the_same_tree(tmp_path, capsys):
    from tracker import main

    told, clip = tmp_path / "told.json", ROOT / "examples" / "clips" / "small.mp4"
    assert main(["--clip", str(clip), "--rounds", "1", "--beside", str(ROOT), "--json", str(told)]) == 0
    figures = json.loads(told.read_text())["figures"]
    assert figures["beside_same_small"] == 1
    steps = [value for name, value in figures.items() if name.startswith("cpu_ms_small_")]
    assert sum(steps) == pytest.approx(figures["cpu_ms_small"], rel=0.05)
    assert figures["cpu_ms_small_finders_network"] > 0
    assert "MediaPipe is left out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--clip", __file__], "is not a video"),
        (["--beside", "/nowhere"], "not a source tree of Deixis"),
        (["--clip", str(ROOT / "examples/clips/small.mp4"), "--mediapipe-python", "/nowhere/python"], "No such file"),
        (
            ["--clip", str(ROOT / "examples/clips/small.mp4"), "--mediapipe-python", sys.executable],
            "No module named 'mediapipe'",
        ),
    ],
)
def test_what_cannot_be_measured_is_told(capsys, options, said):
    from tracker import main

    assert main(["--rounds", "1", *options]) == 1
    assert said in capsys.readouterr().err
