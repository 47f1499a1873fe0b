"""When a process that ended is started again, and when it is given up."""

from deixis_runtime.restarts import Restarts

WHY = "killed by SIGKILL"


def test_the_first_restart_is_at_once_and_the_next_ones_wait_longer():
    restarts = Restarts()
    assert [restarts.after(WHY, at_s).pause_s for at_s in range(5)] == [0.0, 0.25, 0.5, 1.0, 2.0]


def test_the_sixth_end_within_a_minute_gives_it_up_with_the_reason():
    restarts = Restarts()
    for at_s in range(5):
        assert not restarts.after(WHY, at_s).given_up
    assert restarts.after(WHY, 59.0).given_up == "it ended 6 times within 60 s, the last time: killed by SIGKILL"


def test_ends_that_lie_apart_are_each_the_first():
    restarts = Restarts()
    for hour in range(1000):
        verdict = restarts.after(WHY, hour * 3600.0)
        assert (verdict.pause_s, verdict.given_up) == (0.0, "")


def test_ends_that_were_anothers_fault_never_give_a_process_up_but_are_not_repeated_in_haste():
    restarts = Restarts()
    pauses = [restarts.after("no router", at_s, blameless=True).pause_s for at_s in range(100)]
    assert pauses[0] == 0.25
    assert pauses == sorted(pauses)
    assert pauses[-1] == 8.0
    assert restarts.after(WHY, 101.0).pause_s == 0.0, "they do not count against it"
