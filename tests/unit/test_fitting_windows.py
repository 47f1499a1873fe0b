"""Windows that the finder is fitted on: what is asked for has to go with the picture."""

from pathlib import Path

import cv2
import numpy as np
import pytest

SIDE, BREADTH = 192, 40.0
HEAD, RIGHT, LEFT = (90.0, 60.0), (40.0, 120.0), (150.0, 110.0)


@pytest.fixture(autouse=True)
def fitting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder, as for `python fitting/fit_finder.py`."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "fitting"))


def figures(seen: float = 1.0, area: float = 300.0):
    """One picture: a head in red, the right hand in green, the left one in blue, each a square."""
    from figure_files import Figures

    picture = np.full((1, SIDE, SIDE, 3), 20, np.uint8)
    for (x, y), channel in ((HEAD, 2), (RIGHT, 1), (LEFT, 0)):
        picture[0, int(y) - 6 : int(y) + 7, int(x) - 6 : int(x) + 7, channel] = 250
    person = [*HEAD, BREADTH, 900.0, seen, *RIGHT, *LEFT, area, area]
    rooms = np.full((1, 240, 320, 3), 20, np.uint8)
    return Figures(picture, np.array([[person, [np.nan] * 11]], np.float32), rooms)


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """A camera without faults."""
    import fit_windows

    monkeypatch.setattr(fit_windows, "taken", lambda pixels, _: pixels)


def lie_on(maps, pixels, channel):
    """Whether the map's summits lie on what has that colour."""
    others = pixels.sum(axis=2) - pixels[..., channel]
    bright = ((pixels[..., channel] > 120) & (others < 120)).astype(np.uint8)
    near = cv2.dilate(bright, np.ones((9, 9)))[1::4, 1::4] > 0
    return bool(near[maps > 0.9].all())


@pytest.mark.usefixtures("plain")
def test_maps_are_high_where_the_things_are_and_in_the_mirror_hands_change_sides():
    from fit_windows import windows_of

    windows = windows_of(figures(), 100, np.random.default_rng(3))
    upright = mirrored = 0
    for pixels, (head, right, left) in zip(windows.pixels.astype(int), windows.maps, strict=True):
        assert lie_on(head, pixels, 2)
        if min(right.max(), left.max()) > 0.9:
            as_drawn = lie_on(right, pixels, 1) and lie_on(left, pixels, 0)
            swapped = lie_on(right, pixels, 0) and lie_on(left, pixels, 1)
            assert as_drawn != swapped
            upright += as_drawn
            mirrored += swapped
    assert upright > 3
    assert mirrored > 3


@pytest.mark.usefixtures("plain")
def test_what_is_half_hidden_is_not_asked_for_and_what_is_hidden_is_not_there():
    from fit_windows import windows_of

    half = windows_of(figures(seen=0.2, area=40.0), 10, np.random.default_rng(3))
    assert half.maps.max() == 0
    assert (half.weights == 0).any()
    hidden = windows_of(figures(seen=0.01, area=1.0), 10, np.random.default_rng(3))
    assert hidden.maps.max() == 0
    assert (hidden.weights[:, 1:] == 1).all()


@pytest.mark.usefixtures("plain")
def test_sizes_are_those_of_the_window():
    from fit_windows import STRIDE, windows_of

    windows = windows_of(figures(), 20, np.random.default_rng(5))
    for pixels, sizes in zip(windows.pixels.astype(int), windows.sizes, strict=True):
        known = sizes[np.isfinite(sizes)]
        red = (pixels[..., 2] > 200) & (pixels[..., 1] < 60)
        if len(known) and red.any():
            # The widest of the heads: a window may show several.
            *_, shapes, _ = cv2.connectedComponentsWithStats(red.astype(np.uint8))
            widest = shapes[1:, cv2.CC_STAT_WIDTH].max()
            assert 12 * np.exp(known.max()) == pytest.approx(widest * BREADTH / 13, abs=1.5 * STRIDE)
            return
    pytest.fail("no window shows a head")


def test_the_network_answers_in_opencv_as_in_pytorch(tmp_path: Path):
    pytest.importorskip("torch", reason="PyTorch is only needed for fitting")
    pytest.importorskip("onnx", reason="ONNX is only needed for fitting")
    from deixis_tracker.finder import PIXEL_MIDDLE, PIXEL_SPREAD
    from finder_network import Fit

    fit, pixels = Fit(), np.random.default_rng(1).integers(0, 256, (1, 64, 96, 3), np.uint8)
    fit.export(tmp_path / "network.onnx")
    network = cv2.dnn.readNetFromONNX(np.fromfile(tmp_path / "network.onnx", np.uint8))
    network.setInput(cv2.dnn.blobFromImage(pixels[0], 1 / PIXEL_SPREAD, mean=(PIXEL_MIDDLE,) * 3))
    assert network.forward() == pytest.approx(fit.maps(pixels), abs=1e-3)


def test_exported_weights_can_be_gone_on_from(tmp_path: Path):
    pytest.importorskip("torch", reason="PyTorch is only needed for fitting")
    pytest.importorskip("onnx", reason="ONNX is only needed for fitting")
    from finder_network import Fit
    from fit_windows import windows_of

    fit, windows = Fit(), windows_of(figures(), 16, np.random.default_rng(1))
    for _ in range(3):
        fit.step(windows, 0.0)
    fit.export(tmp_path / "network.onnx")
    again = Fit(tmp_path / "network.onnx")
    again.settle(windows)
    assert again.maps(windows.pixels) == pytest.approx(fit.maps(windows.pixels), abs=1e-3)
