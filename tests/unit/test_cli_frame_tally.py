"""Frames are counted by their numbers: a picture that was missed was there, and no more are answered than there are."""

from deixis_cli.frame_tally import RUNS_KEPT, FrameTally
from deixis_schemas.messages import FrameId


def test_a_frame_whose_picture_was_missed_counts_and_one_spoken_of_often_counts_once():
    tally = FrameTally()
    for seq in (0, 1, 1, 4, 3, 4):
        tally.note(FrameId(7, seq))
    assert tally.frames == 5


def test_loops_are_counted_on_and_of_many_only_a_few_are_kept():
    tally = FrameTally()
    for run in range(10 * RUNS_KEPT):
        for seq in (0, 125):
            tally.note(FrameId(run, seq))
    assert tally.frames == 10 * RUNS_KEPT * 126
    assert len(tally._runs) == RUNS_KEPT


def test_nothing_said_is_no_frame():
    assert FrameTally().frames == 0
