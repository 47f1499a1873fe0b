"""Phases from the motion of a hand: free of frame rate, scale and dropped frames."""

import math

import pytest
from deixis_gesture.config import GestureConfig
from deixis_gesture.phases import Motion, PhaseTracker
from hypothesis import given
from hypothesis import strategies as st

REST = (-1.2, 4.4)
HELD = (-3.6, 1.0)
PREPARATION_S, STROKE_S, RETRACTION_S, END_S = 1.0, 1.55, 3.0, 3.55


def _smooth(share):
    """Minimum-jerk profile of reaching movements (Flash and Hogan 1985)."""
    share = min(1.0, max(0.0, share))
    return share**3 * (10 - 15 * share + 6 * share**2)


def _pointing_hand(time_s):
    """Rest, raise, hold, lower; face widths."""
    up = _smooth((time_s - PREPARATION_S) / (STROKE_S - PREPARATION_S))
    down = _smooth((time_s - RETRACTION_S) / (END_S - RETRACTION_S))
    share = up - down
    return REST[0] + share * (HELD[0] - REST[0]), REST[1] + share * (HELD[1] - REST[1])


def _phases(times, hand=_pointing_hand, walking=False):
    tracker = PhaseTracker(GestureConfig())
    return [(t, tracker.update(t, hand(t), hand(t), walking)) for t in times]


def _onsets(phases):
    onsets = {}
    for time_s, phase in phases:
        onsets.setdefault(phase, time_s)
    return onsets


def _times(rate_hz, seconds=4.5):
    return [i / rate_hz for i in range(int(seconds * rate_hz))]


@pytest.mark.parametrize("rate_hz", [10, 15, 30, 60])
def test_a_pointing_hand_passes_all_phases_in_order_and_in_time(rate_hz):
    phases = _phases(_times(rate_hz))
    order = [phase for i, (_, phase) in enumerate(phases) if i == 0 or phases[i - 1][1] != phase]
    assert order == ["idle", "preparation", "stroke", "retraction", "idle"]
    onsets = _onsets(phases)
    late = 0.1 + 1 / rate_hz
    assert PREPARATION_S <= onsets["preparation"] <= PREPARATION_S + 0.1 + late
    assert STROKE_S - 0.1 <= onsets["stroke"] <= STROKE_S + late
    assert RETRACTION_S <= onsets["retraction"] <= RETRACTION_S + late + 0.05


@given(kept=st.lists(st.booleans(), min_size=135, max_size=135))
def test_dropped_frames_do_not_break_a_stroke(kept):
    times = [t for t, keep in zip(_times(30), kept, strict=True) if keep or round(t * 30) % 4 == 0]
    inside = [phase for t, phase in _phases(times) if STROKE_S + 0.25 < t < RETRACTION_S]
    assert inside
    assert set(inside) == {"stroke"}


def test_a_stray_position_does_not_end_a_stroke():
    def torn(time_s):
        x, y = _pointing_hand(time_s)
        return (x + 0.6, y) if abs(time_s - 2.2) < 0.01 else (x, y)

    assert {phase for t, phase in _phases(_times(30), torn) if STROKE_S + 0.1 < t < RETRACTION_S} == {"stroke"}


def test_a_hanging_hand_that_flickers_stays_idle():
    def hanging(time_s):
        return REST[0] + 0.05 * math.sin(37 * time_s), REST[1] + 0.05 * math.cos(29 * time_s)

    assert {phase for _, phase in _phases(_times(30), hanging)} == {"idle"}


def test_a_swinging_arm_of_a_walking_person_stays_idle():
    def swinging(time_s):
        return 5 * time_s + math.sin(6 * time_s), REST[1] - 0.4 * abs(math.sin(6 * time_s))

    assert {phase for _, phase in _phases(_times(30), swinging, walking=True)} == {"idle"}


def test_a_waving_hand_is_never_still_for_long():
    def waving(time_s):
        return -2.3 + 0.75 * math.sin(2 * math.pi * 1.8 * time_s), 0.1

    longest = run = 0
    for _, phase in _phases(_times(30), waving)[6:]:
        run = run + 1 if phase == "stroke" else 0
        longest = max(longest, run)
    assert longest <= 3


@given(st.floats(-20, 20), st.floats(-20, 20), st.sampled_from([10, 15, 30, 60]))
def test_velocity_of_a_steady_motion_is_exact(vx, vy, rate_hz):
    motion = Motion(0.1)
    assert motion.velocity is None
    for i in range(12):
        motion.add(i / rate_hz, (vx * i / rate_hz, vy * i / rate_hz))
    assert motion.velocity == pytest.approx((vx, vy), abs=1e-6)


@pytest.mark.parametrize("rate_hz", [10, 30, 60])
def test_an_outline_that_jumps_to_and_fro_breaks_no_stroke(rate_hz):
    def jumping(time_s):
        x, y = _pointing_hand(time_s)
        return (x + (0.4 if int(8 * time_s) % 2 else 0.0), y) if STROKE_S + 0.2 < time_s < RETRACTION_S else (x, y)

    held = [phase for t, phase in _phases(_times(rate_hz), jumping) if STROKE_S + 0.2 <= t < RETRACTION_S]
    assert set(held) == {"stroke"}


def test_a_waving_hand_does_not_stay_where_it_is_held():
    def waving(time_s):
        x, y = _pointing_hand(time_s)
        return (x + 0.9 * math.sin(2 * math.pi * 2 * time_s), y) if STROKE_S < time_s < RETRACTION_S else (x, y)

    waves = [phase for t, phase in _phases(_times(30), waving) if STROKE_S + 0.3 <= t < RETRACTION_S]
    assert waves.count("stroke") < 0.5 * len(waves)
