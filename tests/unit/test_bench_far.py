"""The benchmark of people far away in large frames."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def bench(monkeypatch):
    """The benchmarks' folder, as for `python bench/far.py`."""
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    yield
    sys.modules.pop("far", None)


def test_a_picture_is_put_into_the_middle_shrunk():
    from far import placed

    picture = np.zeros((100, 200, 3), np.uint8)
    picture[:, 100:] = 255
    large, corner = placed(picture, 0.5)
    assert large.shape == (1080, 1920, 3)
    assert corner == (910, 515)
    assert (large[:, :955] == 0).all()
    assert (large[:, 965:] == 255).all()


def test_a_small_head_is_found_only_where_parts_of_the_frame_are_searched(clips, tmp_path):
    from far import main

    labelled, told = tmp_path / "clips", tmp_path / "told.json"
    labelled.mkdir()
    for name in ("head_turn.mp4", "head_turn.json"):
        (labelled / name).symlink_to(clips / name)
    assert main(["--clips", str(labelled), "--shrunk", "0.4", "--frames", "20", "--json", str(told)]) == 0
    figures = json.loads(told.read_text())["figures"]
    assert figures["faces_0.4"] > 0.5
    assert figures["false_0.4"] == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--clips", "/nowhere"], "not a folder"),
        (["--frames", "1", "--shrunk", "1", "--beside", "/nowhere"], "not a source tree"),
    ],
)
def test_what_cannot_be_measured_is_told(capsys, options, said):
    from far import main

    assert main(options) == 1
    assert said in capsys.readouterr().err
