"""Age of messages by clocks that are not ours."""

import random

import pytest
from deixis_runtime.age import RelativeAge

LIMIT_S = 1.0
PERIOD_S = 1 / 30
FIVE_MINUTES_S = 300.0
DELAY_S = 0.02


class Link:
    """A camera at 30 frames a second whose clock is ahead of ours, seen over a link; all in seconds of our clock."""

    def __init__(self, ahead_s=0.0):
        self.age = RelativeAge()
        self.ahead_s = ahead_s
        self.now_s = 5000.0
        self.run = 1
        self.seq = 0
        self._noise = random.Random(3)

    def capture(self):
        """The next frame: its number and its stamp by the camera's clock."""
        self.now_s += PERIOD_S
        self.seq += 1
        return self.seq, self.now_s + self.ahead_s

    def deliver(self, frame):
        """It arrives now, after the link's usual delay; returns its age."""
        seq, stamp_s = frame
        received_s = self.now_s + DELAY_S + self._noise.random() * 0.01
        self.age.note(self.run, seq, ns(stamp_s), ns(received_s))
        return self.age.age_s(ns(stamp_s), ns(received_s))

    def play(self, seconds):
        """Frames that come as they are made; returns their ages."""
        return [self.deliver(self.capture()) for _ in range(round(seconds / PERIOD_S))]

    def cut(self, seconds):
        """Frames made while the link is cut, delivered all at once; returns their ages, noted all and then judged."""
        held = [self.capture() for _ in range(round(seconds / PERIOD_S))]
        for frame in held:
            self.deliver(frame)
        return [self.age.age_s(ns(stamp_s), ns(self.now_s + DELAY_S)) for _, stamp_s in held]


def ns(seconds):
    return round(seconds * 1e9)


@pytest.fixture(params=[0.0, FIVE_MINUTES_S, -FIVE_MINUTES_S, -1e9], ids=["equal", "ahead", "behind", "of 1970"])
def link(request):
    """Whatever the camera's clock shows."""
    return Link(request.param)


def test_messages_that_come_as_they_are_made_are_young_whatever_the_clock_shows(link):
    assert max(link.play(60)) < 0.1


def test_of_what_a_cut_held_back_the_old_are_told_and_the_newest_kept(link):
    link.play(20)
    ages = link.cut(3)
    assert all(age_s > LIMIT_S for age_s in ages[:55])
    assert all(age_s <= LIMIT_S for age_s in ages[-28:])
    assert max(link.play(5)) < 0.1


def test_a_second_cut_right_after_is_told_too(link):
    link.play(20)
    link.cut(3)
    link.play(0.5)
    assert link.cut(3)[0] > LIMIT_S


def test_a_cut_of_a_minute_does_not_make_the_held_back_the_usual(link):
    link.play(20)
    ages = link.cut(60)
    assert ages[0] > 50
    assert sum(age_s <= LIMIT_S for age_s in ages) <= 31


@pytest.mark.parametrize("step_s", [0.04, 2.0, FIVE_MINUTES_S, -0.04, -2.0, -FIVE_MINUTES_S])
def test_a_clock_that_steps_makes_no_message_old(link, step_s):
    link.play(20)
    link.ahead_s += step_s
    assert max(link.play(60)) <= 0.1


def test_a_clock_that_was_set_back_during_a_cut_heals_within_half_a_minute(link):
    link.play(20)
    link.now_s += 10  # nothing is delivered of these
    link.ahead_s -= 5
    assert max(link.play(31)) > LIMIT_S
    assert max(link.play(60)) < 0.1


def test_a_clock_that_drifts_makes_no_message_old(link):
    for _ in range(600):
        link.ahead_s -= 1e-4 * PERIOD_S * 30  # 100 ppm
        assert max(link.play(1)) < 0.1


def test_another_run_has_its_own_clock(link):
    link.play(20)
    link.run, link.seq, link.ahead_s = 2, 0, link.ahead_s - 1000.0
    assert max(link.play(5)) < 0.1


def test_a_slow_consumer_finds_what_waited_for_it_old(link):
    link.play(20)
    frame = link.capture()
    link.deliver(frame)
    link.now_s += 2.0
    assert link.age.age_s(ns(frame[1]), ns(link.now_s)) == pytest.approx(2.0, abs=0.05)


def test_a_frame_that_comes_out_of_order_changes_nothing(link):
    link.play(20)
    early, late = link.capture(), link.capture()
    link.deliver(late)
    link.deliver(early)
    assert link.cut(3)[0] > LIMIT_S
