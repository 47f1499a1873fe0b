"""What the camera can send less of: the ladder of qualities and rates."""

from itertools import pairwise

import pytest
from deixis_camera.ladder import Rung, ladder, relative_bytes
from hypothesis import given
from hypothesis import strategies as st


def test_quality_is_given_up_before_rate() -> None:
    assert ladder(85, 50, 30.0, 5.0) == (
        Rung(85, 30.0), Rung(75, 30.0), Rung(65, 30.0), Rung(50, 30.0),
        Rung(50, 20.0), Rung(50, 15.0), Rung(50, 10.0), Rung(50, 7.5), Rung(50, 5.0),
    )  # fmt: skip


def test_raw_pictures_have_a_rate_only() -> None:
    assert ladder(None, 50, 30.0, 10.0) == (Rung(None, 30.0), Rung(None, 20.0), Rung(None, 15.0), Rung(None, 10.0))


@given(st.one_of(st.none(), st.integers(1, 100)), st.integers(1, 100), st.floats(0.2, 240), st.floats(0.2, 60))
def test_each_rung_is_of_fewer_bytes_than_the_one_before_and_within_the_limits(
    quality: int | None, least_quality: int, rate_hz: float, least_rate_hz: float
) -> None:
    rungs = ladder(quality, least_quality, rate_hz, least_rate_hz)
    assert rungs[0] == Rung(quality, rate_hz)
    bytes_s = [rung.rate_hz * rung.frame_bytes(40_000, quality) for rung in rungs]
    assert all(more > fewer for more, fewer in pairwise(bytes_s))
    assert all(rung.rate_hz >= min(rate_hz, least_rate_hz) for rung in rungs)
    if quality is not None:
        assert all((rung.quality or 0) >= min(quality, least_quality) for rung in rungs)


def test_bytes_are_told_from_frames_of_another_quality() -> None:
    assert Rung(50, 15.0).frame_bytes(34_300, 85) == pytest.approx(15_300, rel=0.1)  # examples/pointing.mp4
    assert Rung(85, 15.0).frame_bytes(15_300, 50) == pytest.approx(34_300, rel=0.1)


@given(st.integers(1, 99))
def test_a_higher_quality_has_more_bytes(quality: int) -> None:
    assert relative_bytes(quality + 1) > relative_bytes(quality)


@pytest.mark.parametrize("quality", [0, 101])
def test_there_is_no_quality_beyond_1_and_100(quality: int) -> None:
    with pytest.raises(ValueError, match="quality"):
        relative_bytes(quality)
