from itertools import pairwise

from deixis_schemas.runs import RunClock

MS = 1_000_000


def test_another_run_begins_anew_and_an_equal_one_goes_on():
    clock = RunClock()
    assert clock.advance(7, 10**18).new_run
    assert not clock.advance(7, 10**18 + 33 * MS).new_run
    assert clock.advance(3, 10**18 + 66 * MS).new_run


def test_a_clock_set_back_passes_unnoticed():
    clock = RunClock()
    stamps = [0, 33, 66, 26, 59]  # set back by 73 ms before the fourth frame
    moments = [clock.advance(1, 10**18 + stamp * MS) for stamp in stamps]
    assert [moment.new_run for moment in moments] == [True, False, False, False, False]
    assert [round(moment.elapsed_s * 1000) for moment in moments] == [0, 33, 33, 33, 33]
    assert all(a.now_ns < b.now_ns for a, b in pairwise(moments))


def test_an_hour_back_is_no_more_than_a_frame():
    clock = RunClock()
    clock.advance(1, 10**18)
    clock.advance(1, 10**18 + 40 * MS)
    assert clock.advance(1, 10**18 - 3600 * 10**9).elapsed_s == 0.04


def test_a_pause_is_a_pause():
    clock = RunClock()
    clock.advance(1, 10**18)
    assert clock.advance(1, 10**18 + 5 * 10**9).elapsed_s == 5.0
