"""One answer for each frame, in order, with or without all stages; and how sources and their end are judged."""

from __future__ import annotations

import pytest
from deixis_fusion.joining import FrameJoiner
from deixis_fusion.sources import Reading, SourceEnd, SourceMonitor
from deixis_schemas.messages import CameraInfo, FrameId, Gestures, HeadPoses, Tracks
from hypothesis import given
from hypothesis import strategies as st

FRAME_NS = 33_333_333


def tracks(seq: int, run: int = 1) -> Tracks:
    return Tracks(run=run, seq=seq, stamp_ns=10**12 + seq * FRAME_NS, stage="tracker", instance="t", width=640, height=480)


def poses(seq: int, run: int = 1) -> HeadPoses:
    return HeadPoses(run=run, seq=seq, stamp_ns=10**12 + seq * FRAME_NS, stage="headpose", instance="h")


def gestures(seq: int, run: int = 1) -> Gestures:
    return Gestures(run=run, seq=seq, stamp_ns=10**12 + seq * FRAME_NS, stage="gesture", instance="g")


@pytest.fixture
def joiner() -> FrameJoiner:
    return FrameJoiner(age_limit_s=0.3)


def test_a_frame_is_answered_when_all_have_spoken(joiner: FrameJoiner) -> None:
    joiner.add(tracks(0), 0.0)
    joiner.add(gestures(0), 0.01)
    assert joiner.due(0.02) == []
    joiner.add(poses(0), 0.02)
    (frame,) = joiner.due(0.02)
    assert frame.missing == ()
    assert frame.source.seq == 0
    assert joiner.due(1.0) == []


def test_after_the_age_limit_it_is_answered_without_who_is_missing(joiner: FrameJoiner) -> None:
    joiner.add(tracks(0), 0.0)
    joiner.add(gestures(0), 0.1)
    assert joiner.next_due_s() == pytest.approx(0.3)
    assert joiner.due(0.299) == []
    (frame,) = joiner.due(0.3)
    assert frame.missing == ("headpose",)


def test_a_stage_that_answers_a_later_frame_is_not_waited_for(joiner: FrameJoiner) -> None:
    for seq in (0, 1):
        joiner.add(tracks(seq), 0.0)
        joiner.add(gestures(seq), 0.0)
    joiner.add(poses(1), 0.05)
    assert [(frame.source.seq, frame.missing) for frame in joiner.due(0.05)] == [(0, ("headpose",)), (1, ())]


def test_a_dead_stage_is_not_waited_for(joiner: FrameJoiner) -> None:
    joiner.add(tracks(0), 0.0)
    joiner.add(gestures(0), 0.0)
    (frame,) = joiner.due(0.0, absent={"headpose"})
    assert frame.missing == ("headpose",)


def test_an_answer_that_comes_after_the_frame_was_answered_is_dropped_and_counted(joiner: FrameJoiner) -> None:
    joiner.add(tracks(0), 0.0)
    joiner.due(0.3)
    joiner.add(poses(0), 0.4)
    assert joiner.due(1.0) == []
    assert joiner.dropped == 1


def test_another_run_counts_anew(joiner: FrameJoiner) -> None:
    for part in (tracks(500), poses(500), gestures(500)):
        joiner.add(part, 0.0)
    assert len(joiner.due(0.0)) == 1
    for part in (poses(0, run=2), tracks(0, run=2), gestures(0, run=2)):
        joiner.add(part, 1.0)
    assert [frame.source.frame_id for frame in joiner.due(1.0)] == [FrameId(2, 0)]
    assert joiner.dropped == 0


def test_what_is_left_of_a_run_is_answered_when_the_next_one_begins(joiner: FrameJoiner) -> None:
    joiner.add(tracks(8), 0.0)
    joiner.add(poses(9), 0.0)
    joiner.add(tracks(0, run=2), 0.01)
    assert [(frame.source.frame_id, frame.missing) for frame in joiner.due(0.01)] == [
        ((1, 8), ("headpose", "gesture")), ((1, 9), ("tracker", "gesture")),
    ]  # fmt: skip
    joiner.add(gestures(9), 0.02)
    assert joiner.dropped == 1
    assert joiner.next_due_s() == pytest.approx(0.31)


def test_stamps_that_step_back_within_a_run_do_not_begin_another(joiner: FrameJoiner) -> None:
    back = Tracks(run=1, seq=1, stamp_ns=0, stage="tracker", instance="t", width=640, height=480)
    joiner.add(tracks(0), 0.0)
    joiner.add(back, 0.01)
    assert joiner.due(0.02) == []
    assert [frame.source.seq for frame in joiner.due(0.4)] == [0, 1]


def test_frames_whose_tracks_were_lost_are_still_answered(joiner: FrameJoiner) -> None:
    joiner.add(poses(3), 0.0)
    joiner.add(gestures(3), 0.0)
    (frame,) = joiner.due(0.3)
    assert frame.missing == ("tracker",)


def test_memory_is_bounded_when_nothing_completes(joiner: FrameJoiner) -> None:
    for seq in range(2000):
        joiner.add(poses(seq), 0.0)
    assert len(joiner.due(10.0)) <= 256


@given(st.lists(st.tuples(st.sampled_from([tracks, poses, gestures]), st.integers(0, 12)), max_size=60))
def test_no_frame_is_answered_twice_and_answers_keep_their_order(parts: list) -> None:
    joiner = FrameJoiner(0.3)
    answered = []
    for step, (make, seq) in enumerate(parts):
        joiner.add(make(seq), step * 0.05)
        answered += [frame.source.seq for frame in joiner.due(step * 0.05)]
    answered += [frame.source.seq for frame in joiner.due(1000.0)]
    assert answered == sorted(set(answered))


# --- sources ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def monitor() -> SourceMonitor:
    return SourceMonitor(("headpose", "gesture"), dead_after_s=1.0)


def reading(**changes: object) -> Reading:
    content = {"stage": "headpose", "key": "deixis/r1/headpose/poses", "alive": True, "received": 5, "age_s": 0.03}
    return Reading(**(content | changes))  # type: ignore[arg-type]


def test_a_stage_never_heard_of_is_dead(monitor: SourceMonitor) -> None:
    assert monitor.status("headpose", missed=True)[0] == "dead"
    assert "headpose" in monitor.dead()


def test_a_live_stage_that_misses_a_frame_is_late_and_one_that_answers_is_ok(monitor: SourceMonitor) -> None:
    monitor.update([reading()], 0.0)
    assert monitor.status("headpose") == ("ok", "")
    assert monitor.status("headpose", missed=True)[0] == "late"


def test_a_live_stage_that_is_silent_without_missing_a_frame_is_ok_with_no_reason_given(
    monitor: SourceMonitor,
) -> None:
    monitor.update([reading(age_s=2.0)], 0.0)
    (state,) = [state for state in monitor.states() if state.stage == "headpose"]
    assert (state.status, state.reason, state.age_s) == ("ok", "", 2.0)


def test_without_token_and_silent_it_is_dead(monitor: SourceMonitor) -> None:
    monitor.update([reading(alive=False, age_s=0.5)], 0.0)
    assert monitor.status("headpose", missed=True)[0] == "late"
    monitor.update([reading(alive=False, age_s=1.5)], 1.0)
    status, reason = monitor.status("headpose", missed=True)
    assert (status, reason) == ("dead", "gone, silent for 1.5 s")


def test_a_wrong_version_is_said_and_taken_back(monitor: SourceMonitor) -> None:
    bad = {"received": 0, "age_s": None, "last_error": "HeadPoses version '9'", "last_error_kind": "wrong_version"}
    monitor.update([reading(rejected=1, **bad)], 10.0)
    status, reason = monitor.status("headpose", missed=True)
    assert status == "wrong_version"
    assert "version '9'" in reason
    monitor.update([reading(rejected=1, last_error="old")], 10.5)
    assert monitor.status("headpose")[0] == "ok"


def test_a_forgotten_old_stage_does_not_switch_off_the_one_that_replaced_it(monitor: SourceMonitor) -> None:
    beside = {"age_s": 0.03, "last_error": "HeadPoses version '1'", "last_error_kind": "wrong_version"}
    for rejected in range(1, 4):
        monitor.update([reading(rejected=rejected, **beside)], float(rejected))
        assert monitor.status("headpose") == ("ok", "")
        assert "headpose" not in monitor.dead()
    assert monitor.refused() == ["deixis/r1/headpose/poses: some messages are refused: HeadPoses version '1'"]
    assert "version '1'" in next(state.reason for state in monitor.states() if state.stage == "headpose")


def test_garbage_makes_a_stage_late_with_the_reason(monitor: SourceMonitor) -> None:
    monitor.update([reading(rejected=1, age_s=5.0, last_error="poses.0.yaw_deg: too large", last_error_kind="malformed")], 1.0)
    assert monitor.status("headpose", missed=True) == (
        "late",
        "its messages on deixis/r1/headpose/poses are refused: poses.0.yaw_deg: too large",
    )


def test_two_producers_on_one_key_are_said(monitor: SourceMonitor) -> None:
    monitor.update([reading(producers=("headpose/a", "headpose_toy/b"))], 0.0)
    assert monitor.doubled() == ["deixis/r1/headpose/poses: 2 producers: headpose/a, headpose_toy/b"]
    state = next(state for state in monitor.states() if state.stage == "headpose")
    assert state.producers == ["headpose/a", "headpose_toy/b"]
    assert "2 producers" in state.reason


def test_whatever_the_stages_call_themselves_the_state_can_say_it(monitor: SourceMonitor) -> None:
    names = tuple(f"{'s' * 64}/{'i' * 63}{n}" for n in range(8))
    said = {"rejected": 1, "last_error": "x" * 1500, "last_error_kind": "malformed"}
    monitor.update([reading(producers=names, **said)], 0.0)
    state = next(state for state in monitor.states() if state.stage == "headpose")
    assert len(state.reason) == 2000


# --- the end of a source ----------------------------------------------------------------------------------------------


def info(state: str, last_seq: int = -1) -> CameraInfo:
    content = {"stamp_ns": 0, "stage": "camera", "instance": "c", "state": state, "source": "clip.mp4"}
    return CameraInfo.model_validate(content | {"run": 1, "last_seq": last_seq})


def test_a_source_is_over_when_its_last_frame_is_answered_and_only_once() -> None:
    end = SourceEnd(silent_s=1.5)
    end.answered(FrameId(1, 98), 0.0)
    end.hear(info("ended", 99), 0.0)
    assert not end.is_over(0.1, waits=False)
    end.answered(FrameId(1, 99), 0.1)
    assert end.is_over(0.1, waits=False)
    end.hear(info("ended", 99), 3.0)
    assert not end.is_over(5.0, waits=False)


def test_the_frame_of_another_run_with_the_last_ones_number_is_not_the_last() -> None:
    end = SourceEnd(silent_s=9.0)
    end.hear(info("ended", 99), 0.0)
    end.answered(FrameId(0, 99), 0.0)
    assert not end.is_over(0.1, waits=False)


def test_a_source_whose_last_frame_was_lost_is_over_soon_after() -> None:
    end = SourceEnd(silent_s=9.0)
    end.answered(FrameId(1, 97), 0.0)
    end.hear(info("ended", 99), 0.0)
    assert not end.is_over(0.9, waits=False)
    assert end.is_over(1.1, waits=False)


def test_silence_ends_a_live_source_but_not_one_that_waits() -> None:
    end = SourceEnd(silent_s=1.5)
    assert not end.is_over(100.0, waits=False)
    end.answered(FrameId(1, 5), 0.0)
    assert not end.is_over(60.0, waits=True)
    assert end.is_over(60.0, waits=False)
