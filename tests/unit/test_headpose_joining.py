from deixis_headpose.joining import FrameJoiner
from deixis_schemas.messages import Frame, Tracks


def frame(seq: int, run: int = 1, stamp_ns: int = 0) -> Frame:
    return Frame(
        run=run, seq=seq, stamp_ns=stamp_ns, stage="camera", instance="c", width=1, height=1, encoding="mono8", data=b"x"
    )


def tracks(seq: int, run: int = 1) -> Tracks:
    return Tracks(run=run, seq=seq, stamp_ns=0, stage="tracker", instance="t", width=1, height=1)


def test_the_newest_tracks_whose_frame_is_held_are_taken_and_the_older_dropped() -> None:
    joiner = FrameJoiner(4)
    joiner.add_frames([frame(1), frame(2), frame(3)])
    joiner.add_tracks([tracks(1), tracks(2)])
    pair = joiner.take()
    assert pair is not None
    assert (pair[0].seq, pair[1].seq) == (2, 2)
    assert joiner.take() is None


def test_tracks_may_come_before_their_frame() -> None:
    joiner = FrameJoiner(4)
    joiner.add_tracks([tracks(5)])
    assert joiner.take() is None
    joiner.add_frames([frame(5)])
    pair = joiner.take()
    assert pair is not None
    assert pair[0].frame_id == pair[1].frame_id == (1, 5)


def test_stamps_name_nothing() -> None:
    joiner = FrameJoiner(4)
    joiner.add_frames([frame(5, stamp_ns=999)])
    joiner.add_tracks([tracks(5)])
    assert joiner.take() is not None


def test_a_frame_of_another_run_with_the_same_seq_is_not_mistaken() -> None:
    joiner = FrameJoiner(4)
    joiner.add_frames([frame(7, run=2)])
    joiner.add_tracks([tracks(7)])
    assert joiner.take() is None


def test_only_the_last_few_frames_are_kept() -> None:
    joiner = FrameJoiner(2)
    joiner.add_frames([frame(1), frame(2), frame(3)])
    joiner.add_tracks([tracks(1)])
    assert joiner.take() is None


def test_tracks_passed_over_for_newer_ones_are_counted_as_skipped() -> None:
    joiner = FrameJoiner(4)
    joiner.add_frames([frame(1), frame(3)])  # the second was lost on the way
    joiner.add_tracks([tracks(1), tracks(2), tracks(3)])
    assert joiner.take() is not None
    assert joiner.take_dropped() == {"tracks_skipped": 2}
    assert joiner.take_dropped() == {}


def test_tracks_of_frames_that_never_come_are_counted_apart_and_remembered_until_there_is_a_pair() -> None:
    """As by a tracker that numbers frames by itself."""
    joiner = FrameJoiner(2)
    for seq in range(1000, 1005):
        joiner.add_frames([frame(seq)])
        joiner.add_tracks([tracks(seq - 1000)])
        assert joiner.take() is None
    assert joiner.take_dropped() == {"tracks_without_frame": 3}
    assert joiner.unjoined == tracks(2)
    joiner.add_tracks([tracks(1004)])
    assert joiner.take() is not None
    assert joiner.unjoined is None


def test_tracks_that_come_after_their_frame_has_gone_are_late_and_not_without_one() -> None:
    joiner = FrameJoiner(2)
    for seq in range(10):
        joiner.add_frames([frame(seq)])
        joiner.add_tracks([tracks(seq - 3)] if seq >= 3 else [])
        assert joiner.take() is None
    assert joiner.take_dropped() == {"tracks_skipped": 5}
    assert joiner.unjoined is not None
