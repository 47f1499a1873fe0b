"""The network is written twice: in PyTorch, where it is fitted, and in numpy, where it works."""

from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def fitting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder, as for `python fitting/fit_regression.py`."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "fitting"))


def test_the_stage_reads_what_the_fitted_network_says(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is only needed for fitting")
    from deixis_headpose.regression import _forward, standardised, weights_of
    from fit_crops import Crops
    from fit_network import Fit

    rng = np.random.default_rng(3)
    pixels = rng.integers(0, 256, (40, 64, 64, 3), dtype=np.uint8)
    rotations, places = np.tile(np.eye(3), (40, 1, 1)), rng.uniform(-0.3, 0.3, (40, 9, 2))
    crops, fit = Crops(pixels, rotations, places, np.full(40, 0.5), np.full(40, True)), Fit()
    for _ in range(3):
        assert np.isfinite(fit.step(crops, 0.0))
    fit.export(tmp_path / "weights.npz")
    said = _forward(weights_of((tmp_path / "weights.npz").read_bytes()), standardised(pixels))[:, :3]
    assert said == pytest.approx(fit.noses(pixels), abs=0.02)
    again = Fit(tmp_path / "weights.npz", pixels)
    assert again.noses(pixels) == pytest.approx(fit.noses(pixels), abs=0.02)


def test_mixed_weights_lie_between_both() -> None:
    from mean_weights import mean_of

    first, second = {"a_w": np.array([0.0, 4.0], np.float16)}, {"a_w": np.array([8.0, 0.0], np.float16)}
    mixed = mean_of(first, second, 0.25)["a_w"]
    assert mixed.tolist() == [2.0, 3.0]
    assert mixed.dtype == np.float16


def test_weights_of_two_networks_are_not_mixed() -> None:
    from mean_weights import mean_of

    with pytest.raises(ValueError, match="not weights of the same network"):
        mean_of({"a_w": np.zeros(2)}, {"a_w": np.zeros(3)}, 0.5)
    with pytest.raises(ValueError, match=r"--share 1.5"):
        mean_of({"a_w": np.zeros(2)}, {"a_w": np.zeros(2)}, 1.5)
