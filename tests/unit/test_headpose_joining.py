from deixis_headpose.joining import FrameJoiner
from deixis_schemas.messages import Frame, Tracks


def frame(seq: int, stamp_ns: int | None = None) -> Frame:
    stamp = seq * 10 if stamp_ns is None else stamp_ns
    return Frame(run=1, seq=seq, stamp_ns=stamp, stage="camera", instance="c", width=1, height=1, encoding="mono8", data=b"x")


def tracks(seq: int, stamp_ns: int | None = None) -> Tracks:
    stamp = seq * 10 if stamp_ns is None else stamp_ns
    return Tracks(run=1, seq=seq, stamp_ns=stamp, stage="tracker", instance="t", width=1, height=1)


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
    assert pair[0].frame_id == pair[1].frame_id == (5, 50)


def test_a_frame_of_a_restarted_camera_with_the_same_seq_is_not_mistaken() -> None:
    joiner = FrameJoiner(4)
    joiner.add_frames([frame(7, stamp_ns=999)])
    joiner.add_tracks([tracks(7)])
    assert joiner.take() is None


def test_only_the_last_few_frames_are_kept() -> None:
    joiner = FrameJoiner(2)
    joiner.add_frames([frame(1), frame(2), frame(3)])
    joiner.add_tracks([tracks(1)])
    assert joiner.take() is None
