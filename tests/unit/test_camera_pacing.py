"""When pictures are published: rate limit, own rate, lockstep, retries."""

from itertools import pairwise

import pytest
from deixis_camera.pacing import NEEDED_STAGES, OTHER_STAGES, REST_S, Backoff, Lockstep, OwnRate, RateLimit, Readiness
from deixis_schemas import topics
from deixis_schemas.messages import FrameId
from hypothesis import given
from hypothesis import strategies as st

MS = 1_000_000


@pytest.mark.parametrize(("limit_hz", "share"), [(0.0, 1.0), (30.0, 1.0), (60.0, 1.0), (15, 1 / 2), (10, 1 / 3), (20, 2 / 3)])
def test_a_rate_limit_leaves_out_pictures_evenly(limit_hz: float, share: float) -> None:
    limit = RateLimit(limit_hz)
    passed = [i for i in range(300) if limit.lets(round(i * 1e9 / 30))]
    assert len(passed) == pytest.approx(300 * share, abs=2)
    gaps = {b - a for a, b in pairwise(passed)}
    assert max(gaps) - min(gaps) <= 1


def test_a_limit_at_the_rate_of_the_source_passes_every_picture_though_they_come_unevenly() -> None:
    limit = RateLimit(30.0)
    assert all(limit.lets(round(i * 1e9 / 30) + (2 * MS if i % 2 else -MS)) for i in range(100))


@given(st.lists(st.integers(0, 200), min_size=1, max_size=200), st.floats(1, 60))
def test_a_rate_limit_never_passes_more_than_its_rate(gaps_ms: list[int], limit_hz: float) -> None:
    limit, now, passed = RateLimit(limit_hz), 0, []
    for gap in gaps_ms:
        now += gap * MS
        if limit.lets(now):
            passed.append(now)
    longest = (passed[-1] - passed[0]) / 1e9 if passed else 0.0
    assert len(passed) <= longest * limit_hz / 0.9 + 2


def test_a_rate_limit_that_is_changed_holds_from_the_next_picture_on() -> None:
    limit, passed = RateLimit(30.0), []
    for i in range(90):
        if i == 30:
            limit.limit(10.0)
        passed += [i] if limit.lets(round(i * 1e9 / 30)) else []
    assert passed[:30] == list(range(30))
    assert passed[30:] == list(range(passed[30], 90, 3))


def test_a_clock_that_steps_back_does_not_stop_the_pictures() -> None:
    limit = RateLimit(10.0)
    assert limit.lets(10_000_000 * MS)
    assert limit.lets(5 * MS)
    assert not limit.lets(50 * MS)
    assert limit.lets(105 * MS)


def test_a_recording_plays_at_its_own_rate() -> None:
    rate = OwnRate(25.0)
    assert rate.decide(0, 1000 * MS, True).act == "publish"
    early = rate.decide(40 * MS, 1010 * MS, True)
    assert early.act == "wait"
    assert early.wait_s == pytest.approx(0.030)
    due = rate.decide(40 * MS, 1043 * MS, True)
    assert (due.act, due.late_ns) == ("publish", 3 * MS)


def test_a_picture_whose_time_has_passed_is_dropped_where_a_newer_one_is_ready() -> None:
    rate = OwnRate(25.0)
    rate.decide(0, 0, True)
    assert rate.decide(40 * MS, 90 * MS, newer_ready=True).act == "drop"
    assert rate.decide(80 * MS, 90 * MS, newer_ready=True).act == "publish"


def test_a_reader_slower_than_the_rate_plays_every_picture_late_and_drops_none() -> None:
    rate = OwnRate(25.0)
    decisions = [rate.decide(i * 40 * MS, i * 100 * MS, newer_ready=False) for i in range(20)]
    assert {decision.act for decision in decisions} == {"publish"}
    assert all(decision.late_ns == 0 and decision.fell_behind for decision in decisions[1:])


def test_pauses_between_retries_double_up_to_the_longest_and_start_anew_after_a_success() -> None:
    backoff = Backoff(0.5, 10.0)
    assert [backoff.next_s() for _ in range(7)] == [0.5, 1, 2, 4, 8, 10, 10]
    backoff.succeeded()
    assert backoff.next_s() == 0.5


def test_lockstep_feeds_the_next_frame_when_fusion_has_answered_the_last() -> None:
    lockstep = Lockstep(2.0)
    assert lockstep.may_feed(0.0)
    lockstep.sent(FrameId(123, 7), 0, 0.0)
    assert not lockstep.may_feed(1.9)
    lockstep.answered(FrameId(99, 7))
    assert not lockstep.may_feed(1.9), "the answer to the frame of that number of another run is not the answer"
    lockstep.answered(FrameId(123, 7))
    assert lockstep.may_feed(1.9)
    assert lockstep.given_up() is None


def test_lockstep_goes_on_when_no_answer_comes_and_names_the_frame_once() -> None:
    lockstep = Lockstep(2.0)
    lockstep.sent(FrameId(123, 7), 0, 0.0)
    assert lockstep.may_feed(2.0)
    assert lockstep.given_up() == 7
    assert lockstep.given_up() is None


def test_a_looped_recording_in_lockstep_is_played_at_its_own_rate_at_most_and_another_as_fast_as_it_is_answered() -> None:
    looped, to_its_end = Lockstep(2.0, looped=True), Lockstep(2.0)
    for lockstep in (looped, to_its_end):
        assert lockstep.early_s(0, 5.0) == 0, "the first one has no time to wait for"
        lockstep.sent(FrameId(123, 7), 400_000_000, 5.0)
        lockstep.answered(FrameId(123, 7))
    assert looped.early_s(500_000_000, 5.03) == pytest.approx(0.07)
    assert looped.early_s(500_000_000, 5.2) == 0
    assert to_its_end.early_s(500_000_000, 5.03) == 0


def test_the_stages_to_wait_for_are_those_of_the_topic_table() -> None:
    assert {"camera", *OTHER_STAGES} == set(topics.STAGES)
    assert "camera" not in OTHER_STAGES
    assert NEEDED_STAGES < OTHER_STAGES


def test_the_first_frame_waits_for_all_stages_and_a_receiver() -> None:
    readiness = Readiness(0.0, 20.0)
    assert not readiness.ready(set(OTHER_STAGES), False, 1.0)
    assert not readiness.ready({"tracker"}, True, 2.0)
    assert readiness.ready({*OTHER_STAGES, "camera"}, True, 3.0)


def test_the_first_frame_does_not_wait_for_stages_that_were_left_out() -> None:
    readiness = Readiness(0.0, 20.0)
    assert not readiness.ready(set(NEEDED_STAGES), True, 1.0)
    assert not readiness.ready({"tracker"}, True, 2.0), "fusion went away: the rest starts anew"
    assert not readiness.ready(set(NEEDED_STAGES), True, 3.0)
    assert not readiness.ready(set(NEEDED_STAGES), True, 2.9 + REST_S)
    assert readiness.ready(set(NEEDED_STAGES), True, 3.0 + REST_S)


def test_the_wait_for_the_first_frame_is_bounded() -> None:
    readiness = Readiness(0.0, 20.0)
    assert readiness.ready(set(), False, 20.0)
    assert readiness.timed_out(20.0)
