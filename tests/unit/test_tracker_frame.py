import pytest
from deixis_tracker.frame import Step, repeated


def steps(rate_hz, seconds, rounded_to_ns=1):
    last = 0
    for k in range(1, round(rate_hz * seconds) + 1):
        run_ns = round(k * 1e9 / rate_hz / rounded_to_ns) * rounded_to_ns
        yield Step(run_ns, run_ns, run_ns - last)
        last = run_ns


@pytest.mark.parametrize("rate_hz", [10, 15, 25, 30, 60])
def test_a_beat_comes_as_often_at_any_frame_rate(rate_hz):
    assert sum(step.periods(0.5) for step in steps(rate_hz, 20)) == 40


@pytest.mark.parametrize("rounded_to_ns", [1, 1_000_000])
def test_a_sixth_of_a_second_is_every_fifth_frame_at_30_fps_however_stamps_are_rounded(rounded_to_ns):
    due = [k for k, step in enumerate(steps(30, 600, rounded_to_ns), 1) if step.periods(1 / 6)]
    assert due == list(range(5, 18001, 5))


def test_beats_ahead_of_others_fall_into_other_frames():
    every = list(steps(30, 10))
    assert not any(step.periods(1 / 6) and step.periods(1 / 6, 1 / 30) for step in every)


@pytest.mark.parametrize("rate_hz", [10, 30, 60])
def test_what_fades_is_as_far_gone_after_a_second_at_any_frame_rate(rate_hz):
    left = 1.0
    for step in steps(rate_hz, 1):
        left *= step.kept(0.2)
    assert left == pytest.approx(0.2)


def test_lessons_that_fell_into_one_frame_count_as_often():
    assert repeated(0.1, 1) == pytest.approx(0.1)
    assert repeated(0.1, 3) == pytest.approx(1 - 0.9**3)
