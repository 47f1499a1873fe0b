"""What is sent over a link that carries less than all, by how it arrives: the pure controller on simulated links."""

from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise
from statistics import quantiles

import pytest
from deixis_camera.adaptation import LONGEST_HOLD_S, Adaptation
from deixis_camera.in_flight import InFlight
from deixis_camera.ladder import Rung, ladder
from deixis_schemas.messages import FrameId
from hypothesis import given, settings
from hypothesis import strategies as st

TICK_S = 1 / 240
SOURCE_HZ = 30.0
SLACK_S = 0.1
BYTES_AT_85 = 40_000
RUNGS = ladder(85, 50, SOURCE_HZ, 5.0)


@dataclass
class SimulatedLink:
    """A queue before a link of so many bytes a second, a fixed way there and back, a reader that takes the newest frame.

    What does not fit into the queue is dropped, and while it is cut all is lost. Times in `arriving`: arrived, sent.
    """

    bytes_s: float
    way_s: float = 0.015
    reader_s: float = 0.02
    queue_bytes: int = 1_000_000
    is_cut: bool = False
    free_at_s: float = 0.0
    reader_free_at_s: float = 0.0
    arriving: deque[tuple[float, float, FrameId]] = field(default_factory=deque)
    answers: deque[tuple[float, float, FrameId]] = field(default_factory=deque)

    def send(self, frame_id: FrameId, size: int, now_s: float) -> None:
        waiting_s = max(0.0, self.free_at_s - now_s)
        if self.is_cut or waiting_s * self.bytes_s + size > self.queue_bytes:
            return
        self.free_at_s = now_s + waiting_s + size / self.bytes_s
        self.arriving.append((self.free_at_s + self.way_s, now_s, frame_id))

    def read(self, now_s: float) -> None:
        if now_s < self.reader_free_at_s:
            return
        newest = None
        while self.arriving and self.arriving[0][0] <= now_s:
            newest = self.arriving.popleft()
        if newest is not None:
            self.reader_free_at_s = now_s + self.reader_s
            self.answers.append((self.reader_free_at_s + self.way_s, *newest[1:]))

    def cut(self) -> None:
        self.is_cut = True
        self.arriving.clear()
        self.answers.clear()
        self.free_at_s = 0.0


@dataclass
class Played:
    """What came of it: (time, seconds to the answer), and (time, rung) of each frame that was sent."""

    ages: list[tuple[float, float]] = field(default_factory=list)
    sent: list[tuple[float, Rung]] = field(default_factory=list)
    rungs: list[Rung] = field(default_factory=list)

    def p95_s(self, after_s: float = 0.0) -> float:
        return quantiles([took for at, took in self.ages if at >= after_s], n=20)[-1]

    def rate_hz(self, first_s: float, last_s: float) -> float:
        return sum(first_s <= at < last_s for at, _ in self.ages) / (last_s - first_s)


class Camera:
    """A camera of 30 Hz with the controller, on a link."""

    def __init__(self, link: SimulatedLink, rungs: tuple[Rung, ...] = RUNGS) -> None:
        self.link, self.now_s, self.played = link, 0.0, Played()
        self.adaptation = Adaptation(rungs, SLACK_S, 0.0)
        self._next_s, self._seq = 0.0, 0

    def play(self, seconds: float) -> None:
        until_s = self.now_s + seconds
        while self.now_s < until_s:
            self._hear()
            self.adaptation.turn(self.now_s)
            self.played.rungs.append(self.adaptation.rung)
            if self.now_s >= self._next_s:
                self._picture()
            self.now_s += TICK_S

    def _hear(self) -> None:
        self.link.read(self.now_s)
        while self.link.answers and self.link.answers[0][0] <= self.now_s:
            _, sent_s, frame_id = self.link.answers.popleft()
            self.adaptation.answered(frame_id, self.now_s)
            self.played.ages.append((self.now_s, self.now_s - sent_s))

    def _picture(self) -> None:
        rung = self.adaptation.rung
        self._next_s = max(self._next_s + 1 / rung.rate_hz, self.now_s)
        self._seq += 1
        if not self.adaptation.due(self.now_s):
            return
        size = round(rung.frame_bytes(BYTES_AT_85, 85))
        self.adaptation.sent(FrameId(1, self._seq), size, rung.quality, self.now_s)
        self.link.send(FrameId(1, self._seq), size, self.now_s)
        self.played.sent.append((self.now_s, rung))


def changes(rungs: list[Rung]) -> int:
    return sum(a != b for a, b in pairwise(rungs))


def test_a_link_that_carries_all_gets_the_best_within_three_seconds() -> None:
    camera = Camera(SimulatedLink(5e6))
    camera.play(3.0)
    assert camera.adaptation.rung == RUNGS[0]
    camera.play(30.0)
    assert set(camera.played.rungs[-240 * 30 :]) == {RUNGS[0]}, "and keeps it"
    assert camera.played.rate_hz(3.0, 33.0) == pytest.approx(SOURCE_HZ, rel=0.02)


def test_the_first_frames_are_few_and_small() -> None:
    camera = Camera(SimulatedLink(5e6))
    camera.play(0.1)
    assert {rung for _, rung in camera.played.sent} == {RUNGS[-1]}


@given(st.floats(100_000, 1_100_000))
@settings(max_examples=15)
def test_frames_are_young_on_any_link_that_carries_the_smallest(bytes_s: float) -> None:
    camera = Camera(SimulatedLink(bytes_s))
    camera.play(40.0)
    # On its way, and before it one frame that is being sent, and the slack.
    alone_s = 0.05 + 2 * RUNGS[-1].frame_bytes(BYTES_AT_85, 85) / bytes_s
    assert camera.played.p95_s(after_s=3.0) <= alone_s + 2 * SLACK_S
    assert camera.played.rate_hz(5.0, 40.0) >= 4.0


@given(st.floats(100_000, 1_100_000))
@settings(max_examples=10)
def test_most_of_what_a_link_carries_is_used(bytes_s: float) -> None:
    camera = Camera(SimulatedLink(bytes_s))
    camera.play(90.0)
    late = [rung.frame_bytes(BYTES_AT_85, 85) for at, rung in camera.played.sent if at >= 60.0]
    assert sum(late) / 30.0 >= 0.5 * min(bytes_s, BYTES_AT_85 * SOURCE_HZ)


def test_without_holding_back_the_same_link_makes_frames_old() -> None:
    link = SimulatedLink(500_000)
    for seq in range(300):
        link.send(FrameId(1, seq), BYTES_AT_85, seq / SOURCE_HZ)
    ages = [arrived - sent for arrived, sent, _ in link.arriving]
    assert max(ages) > 1.5, "the simulated link is a bad one, and the tests above can fail"


def test_what_does_not_fit_is_tried_ever_more_seldom() -> None:
    camera = Camera(SimulatedLink(800_000))  # between the first and the second rung
    camera.play(60.0)
    early = changes(camera.played.rungs[240 * 5 : 240 * 30])
    camera.play(120.0)
    late = changes(camera.played.rungs[-240 * 60 :])
    assert late <= 2 * (60 / LONGEST_HOLD_S) + 2
    assert late < early


def test_it_goes_up_again_when_the_link_carries_more_again() -> None:
    camera = Camera(SimulatedLink(250_000))
    camera.play(60.0)
    assert camera.adaptation.rung.rate_hz < SOURCE_HZ
    camera.link.bytes_s = 5e6
    camera.play(LONGEST_HOLD_S + 20.0)
    assert camera.adaptation.rung == RUNGS[0]


@pytest.mark.parametrize(("cut_s", "as_before_s"), [(0.5, 12.0), (2.0, 4.0), (30.0, 4.0)])
def test_after_a_cut_answers_come_at_once_and_all_is_soon_as_before(cut_s: float, as_before_s: float) -> None:
    camera = Camera(SimulatedLink(5e6))
    camera.play(10.0)
    camera.link.cut()
    camera.play(cut_s)
    camera.link.is_cut = False
    back_s = camera.now_s
    camera.play(as_before_s)
    assert min(at for at, _ in camera.played.ages if at >= back_s) <= back_s + 0.5
    assert camera.adaptation.rung == RUNGS[0]


def test_on_a_cut_link_few_and_small_frames_ask_whether_it_is_back() -> None:
    camera = Camera(SimulatedLink(5e6))
    camera.play(10.0)
    camera.link.cut()
    camera.play(10.0)
    asked = [rung for at, rung in camera.played.sent if at >= 12.0]
    assert 16 <= len(asked) <= 41
    assert set(asked) == {RUNGS[-1]}
    assert camera.adaptation.report().silent


def test_a_reader_that_is_too_slow_for_all_frames_is_no_reason_to_send_less() -> None:
    """It takes the newest; the link is not to blame."""
    camera = Camera(SimulatedLink(5e6, reader_s=0.08))
    camera.play(40.0)
    assert camera.adaptation.rung == RUNGS[0]
    assert camera.played.rate_hz(10.0, 40.0) == pytest.approx(1 / 0.08, rel=0.1)


def test_a_long_way_alone_is_no_reason_to_send_less() -> None:
    camera = Camera(SimulatedLink(5e6, way_s=0.15))
    camera.play(40.0)
    assert camera.adaptation.rung == RUNGS[0]
    assert camera.played.rate_hz(10.0, 40.0) == pytest.approx(SOURCE_HZ, rel=0.05)


@given(
    st.lists(st.tuples(st.sampled_from(["due", "sent", "answered", "turn"]), st.floats(0, 3), st.integers(0, 20)), max_size=200)
)
def test_whatever_happens_the_rung_is_one_of_the_ladder(events: list[tuple[str, float, int]]) -> None:
    adaptation, now_s = Adaptation(RUNGS, SLACK_S, 0.0), 0.0
    for what, passed_s, number in events:
        now_s += passed_s
        if what == "due":
            adaptation.due(now_s)
        elif what == "sent":
            adaptation.sent(FrameId(1, number), 1000 * number, 50, now_s)
        elif what == "answered":
            adaptation.answered(FrameId(1, number), now_s)
        else:
            adaptation.turn(now_s)
        assert adaptation.rung in RUNGS
        assert adaptation.report().quickest_s >= 0.0


def test_an_answer_overtakes_the_frames_before_it() -> None:
    frames = InFlight(SLACK_S)
    for seq in range(5):
        frames.sent(FrameId(1, seq), 1000, 0.01 * seq)
    arrival = frames.answered(FrameId(1, 3), 0.2)
    assert arrival is not None
    assert (arrival.took_s, arrival.passed_over) == (pytest.approx(0.17), 3)
    assert frames.answered(FrameId(1, 2), 0.3) is None, "it is not waited for any more"
    assert frames.answered(FrameId(2, 4), 0.3) is None, "another run's"
    assert frames.waited_s(0.3) == pytest.approx(0.26)


def test_the_next_frame_waits_while_one_is_late_and_asks_again_after_a_quarter_of_a_second() -> None:
    frames = InFlight(SLACK_S)
    frames.sent(FrameId(1, 0), 1000, 0.0)
    frames.answered(FrameId(1, 0), 0.05)
    frames.sent(FrameId(1, 1), 1000, 1.0)
    assert frames.may_send(1.14)
    assert not frames.may_send(1.16)
    assert frames.may_send(1.26)


def test_answers_that_are_never_quick_do_not_become_the_measure() -> None:
    frames = InFlight(SLACK_S)
    for seq in range(60):
        frames.sent(FrameId(1, seq), 1000, float(seq))
        frames.answered(FrameId(1, seq), seq + 0.9)
    frames.sent(FrameId(1, 60), 1000, 60.0)
    assert not frames.may_send(60.6)
