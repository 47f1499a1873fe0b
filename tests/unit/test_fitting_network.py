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
