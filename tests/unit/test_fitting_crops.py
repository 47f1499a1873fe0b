"""Crops that the regression of head pose is fitted on: the truth has to turn, shift and mirror with the picture."""

from pathlib import Path

import numpy as np
import pytest
from deixis_headpose.head import rotation_of


@pytest.fixture(autouse=True)
def fitting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder, as for `python fitting/fit_regression.py`."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "fitting"))


def a_crowd(count: int):
    """Portraits of nothing, whose ears, eyes and crown lie where weak perspective puts them for their rotation."""
    from deixis_simulation.portraits import LANDMARKS, SIDE_PX
    from fit_crops import Portraits

    rng = np.random.default_rng(4)
    head = {"right_ear": (-1, 0, 0), "left_ear": (1, 0, 0), "crown": (0, -1.6, 0), "nose": (0, 0.2, -1.3), "chin": (0, 1.5, -1)}
    head |= {"right_eye": (-0.4, 0, -1.1), "left_eye": (0.4, 0, -1.1), "mouth": (0, 0.8, -1.2)}
    points = np.array([head[name] for name in LANDMARKS])
    rotations = np.array([rotation_of(*rng.uniform(-0.6, 0.6, 3)) for _ in range(count)])
    centres, breadths = rng.uniform(40, 56, (count, 2)), rng.uniform(25, 35, count)
    places = np.array([c + b / 2 * (points @ r.T)[:, :2] for c, b, r in zip(centres, breadths, rotations, strict=True)])
    pictures = rng.integers(0, 256, (count, SIDE_PX, SIDE_PX, 3), dtype=np.uint8)
    return Portraits(pictures, rotations, places, centres, breadths), points


def test_the_truth_of_a_crop_goes_with_its_picture() -> None:
    from fit_crops import crops_of

    crowd, points = a_crowd(60)
    crops = crops_of(crowd, np.arange(60), np.random.default_rng(1))
    for rotation, places, breadth in zip(crops.rotations, crops.places, crops.breadths, strict=True):
        assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-6)
        assert np.linalg.det(rotation) == pytest.approx(1)
        expected = places[8] + breadth / 2 * (points @ rotation.T)[:, :2]
        assert places[:8] == pytest.approx(expected, abs=1e-5)


def test_a_share_of_the_crops_shows_no_head_and_says_so() -> None:
    from fit_crops import crops_of

    crowd, _ = a_crowd(60)
    crops = crops_of(crowd, np.tile(np.arange(60), 10), np.random.default_rng(2))
    assert 0.03 < np.mean(~crops.head) < 0.15
    away = np.linalg.norm(crops.places[:, 8], axis=1)
    assert away[~crops.head].min() > 0.5


def test_crops_are_pictures_of_the_size_that_the_stage_reads() -> None:
    from deixis_headpose.head_crop import INPUT_PX
    from fit_crops import crops_of

    crowd, _ = a_crowd(30)
    crops = crops_of(crowd, np.arange(30), np.random.default_rng(3))
    assert crops.pixels.shape == (30, INPUT_PX, INPUT_PX, 3)
    assert crops.pixels.dtype == np.uint8
