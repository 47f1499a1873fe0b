"""Two processes of a stage change places: whatever comes late, twice or not at all, no frame is answered by both."""

from collections import Counter, deque

import pytest
from deixis_runtime.voice import (
    ABSENT_S,
    LEAD_FRAMES,
    LEAVE_AFTER_S,
    LINKED_S,
    SPARE_ABSENT_S,
    TAKE_WITHIN_S,
    TAKEN_WITHIN_S,
    Seen,
    Voice,
    YieldRefused,
)
from deixis_schemas.messages import FrameId
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

LONG_S = 100.0
ON_ITS_WAY_S = TAKEN_WITHIN_S - TAKE_WITHIN_S - 0.1


def seen(*alive, now_s, linked_s=LONG_S, first_spare=True):
    return Seen(set(alive), first_spare, linked_s, now_s)


class Process:
    """One party: its core, the frames that wait for it, and what it knows of the other."""

    def __init__(self, name, *, standing_by):
        self.name, self.voice = name, Voice(standing_by=standing_by)
        self.frames, self.inbox = deque(), deque()
        self.other_heard = standing_by
        self.shown = not standing_by
        self.alive = True


class Swaps(RuleBasedStateMachine):
    """Frames, questions, answers, tokens, ends, in any order. What one says comes to the other in order, within a second."""

    def __init__(self):
        super().__init__()
        self.now_s, self.run, self.seq = 0.0, 0, 0
        self.old, self.new = Process("old", standing_by=False), Process("new", standing_by=True)
        self.answered = Counter()
        self.questions, self.replies = deque(), deque()

    def other(self, process):
        return self.new if process is self.old else self.old

    def show(self, process):
        """The token follows how it stands."""
        if process.alive and process.voice.heard != process.shown:
            process.shown = process.voice.heard
            self.tell(process, process.shown)

    def tell(self, process, what):
        self.other(process).inbox.append((self.now_s, what))

    def receive(self, process):
        _, what = process.inbox.popleft()
        if isinstance(what, FrameId):
            if not process.voice.heard:
                process.voice.hear(what)
        else:
            process.other_heard = what

    def look(self, process):
        if process.alive:
            others = {self.other(process).name} if process.other_heard else set()
            process.voice.look(Seen(others, True, LONG_S, self.now_s))
            self.show(process)

    def frame(self, process):
        frame = process.frames.popleft()
        if process.alive and process.voice.answers(frame, self.now_s):
            self.answered[frame] += 1
            self.tell(process, frame)

    @rule(new_run=st.sampled_from([False] * 8 + [True]), count=st.integers(1, 25))
    def camera(self, new_run, count):
        if new_run:
            self.run, self.seq = self.run + 1, 0
        for _ in range(count):
            for process in (self.old, self.new):
                process.frames.append(FrameId(self.run, self.seq))
            self.seq += 1

    @rule(of_new=st.booleans(), count=st.integers(1, 40), lost=st.booleans())
    def hear_frames(self, of_new, count, lost):
        process = self.new if of_new else self.old
        for number in range(min(count, len(process.frames))):
            if lost and number % 2:
                process.frames.popleft()
            else:
                self.frame(process)

    @rule(of_new=st.booleans())
    def hear_other(self, of_new):
        process = self.new if of_new else self.old
        if process.inbox:
            self.receive(process)
        self.look(process)

    @rule(dt_s=st.sampled_from([0.001, 0.05, 0.3, 1.0, 2.0]))
    def time_passes(self, dt_s):
        for _ in range(max(1, round(dt_s / 0.3))):
            self.now_s += dt_s / max(1, round(dt_s / 0.3))
            for process in (self.old, self.new):
                while process.inbox and self.now_s - process.inbox[0][0] > ON_ITS_WAY_S - 0.3:
                    self.receive(process)
                if process.alive and process.voice.asks_in_vain(self.now_s):
                    process.voice.unanswered()
                self.look(process)

    @precondition(lambda self: self.new.alive and self.new.voice.state == "stands_by")
    @rule(twice=st.booleans())
    def ask(self, twice):
        self.new.voice.ask("old", self.now_s)
        self.questions.extend(["?"] * (1 + twice))

    @precondition(lambda self: self.questions)
    @rule(lost=st.booleans())
    def answer(self, lost):
        self.questions.popleft()
        if not self.old.alive:
            return
        try:
            fence = self.old.voice.yield_to("new", self.now_s)
        except YieldRefused as error:
            self.replies.append(str(error))
        else:
            if not lost:
                self.replies.append((fence,))
        self.show(self.old)

    @precondition(lambda self: self.replies)
    @rule(newest_first=st.booleans())
    def hear_reply(self, newest_first):
        reply = self.replies.pop() if newest_first else self.replies.popleft()
        if self.new.alive and self.new.voice.state == "asks":
            if isinstance(reply, str):
                self.new.voice.refused(reply)
            else:
                self.new.voice.take(*reply, self.now_s)
            self.show(self.new)

    @rule(which=st.sampled_from(["neither", "neither", "neither", "neither", "old", "new"]))
    def end(self, which):
        for process in (self.old, self.new):
            if process.name == which and process.alive:
                process.alive = False
                if process.shown:
                    self.tell(process, False)

    @precondition(lambda self: self.old.alive and not self.old.voice.must_stay(self.now_s))
    @rule()
    def leave(self):
        self.old.alive = False

    @invariant()
    def no_frame_is_answered_twice(self):
        assert all(count == 1 for count in self.answered.values()), self.answered


Swaps.TestCase.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)
TestSwaps = Swaps.TestCase


def play(voice, frames, now_s=0.0):
    """Those of the frames, `seq` of run 1, that it answers."""
    return [seq for seq in frames if voice.answers(FrameId(1, seq), now_s)]


@pytest.fixture
def pair():
    """The old one and a newcomer, both past frame 9."""
    old, new = Voice(), Voice(standing_by=True)
    assert play(old, range(10)) == list(range(10))
    assert play(new, range(10)) == []
    return old, new


def handed_over(old, new, now_s=0.0):
    new.ask("old", now_s)
    fence = old.yield_to("new", now_s)
    assert new.take(fence, now_s)
    return fence


def test_each_frame_is_answered_once_when_both_hear_all(pair):
    old, new = pair
    fence = handed_over(old, new)
    assert fence == FrameId(1, 10 + LEAD_FRAMES)
    assert play(old, range(10, 60)) == list(range(10, fence.seq))
    assert play(new, range(10, 60)) == list(range(fence.seq, 60))


def test_a_run_that_begins_before_the_frame_comes_is_the_newcomers(pair):
    old, new = pair
    handed_over(old, new)
    assert not old.answers(FrameId(2, 0), 0.0)
    assert new.answers(FrameId(2, 0), 0.0)


def test_without_frames_the_next_one_is_the_newcomers(pair):
    old, new = pair
    assert handed_over(old, new, 5.0) == FrameId(1, 10)
    never = Voice()
    assert never.yield_to("new", 0.0) is None
    assert play(never, range(3)) == []


def test_two_swaps_at_once_are_refused_and_the_same_one_is_told_the_same(pair):
    old, _ = pair
    fence = old.yield_to("new", 0.0)
    assert old.yield_to("new", 0.5) == fence
    with pytest.raises(YieldRefused, match="yields to new already"):
        old.yield_to("newer", 0.5)
    with pytest.raises(YieldRefused, match="it stands by"):
        Voice(standing_by=True).yield_to("new", 0.0)


def test_an_answer_that_comes_late_counts_for_nothing_and_the_old_one_goes_on(pair):
    old, new = pair
    new.ask("old", 0.0)
    fence = old.yield_to("new", 0.0)
    assert not new.take(fence, TAKE_WITHIN_S + 0.1)
    assert old.look(seen(now_s=TAKEN_WITHIN_S - 0.1)) == ""
    assert "has not taken the place: it speaks again" in old.look(seen(now_s=TAKEN_WITHIN_S))
    assert play(old, range(10, 60)) == list(range(10, 60))


def test_when_the_newcomer_dies_the_old_one_speaks_again_but_on_no_frame_twice(pair):
    old, new = pair
    fence = handed_over(old, new)
    play(old, range(10, 40))
    for seq in play(new, range(10, 45)):
        old.hear(FrameId(1, seq))
    assert old.look(seen("new", now_s=1.0)) == ""
    assert old.look(seen(now_s=2.0)) == ""
    assert old.look(seen(now_s=2.0 + ABSENT_S)) == "new is gone: it speaks again"
    assert play(old, range(40, 60)) == list(range(45, 60))
    assert fence.seq < 45


def test_a_successor_that_was_out_of_sight_behind_a_cut_link_has_the_place_again(pair):
    old, new = pair
    handed_over(old, new)
    old.look(seen("new", now_s=1.0))
    old.look(seen(now_s=2.0))
    assert old.look(seen(now_s=3.0))
    assert old.heard
    assert old.look(seen("new", now_s=4.0)) == "new is back: it has the place"
    assert play(old, range(10, 20)) == []


def test_nobodys_absence_is_believed_while_the_tokens_come_back_after_a_restart_of_the_router(pair):
    old, new = pair
    handed_over(old, new)
    old.look(seen("new", now_s=1.0))
    for tenth in range(20):
        assert old.look(seen(now_s=2.0 + tenth / 10, linked_s=min(tenth / 10, LINKED_S - 0.1))) == ""
    assert old.state == "yields"


def test_a_spare_takes_over_where_nobody_speaks_and_only_the_first_of_them(pair):
    _, new = pair
    other = Voice(standing_by=True)
    for now_s in (0.0, SPARE_ABSENT_S):
        assert other.look(seen(now_s=now_s, first_spare=False)) == ""
        said = new.look(seen(now_s=now_s))
    assert said == "nobody speaks for the stage: it does"
    assert play(new, range(5, 12)) == [10, 11]
    assert not other.heard


def test_it_leaves_only_when_the_newcomer_has_the_place_and_after_a_while_by_itself(pair):
    old, new = pair
    assert "not yielded" in old.must_stay(0.0)
    fence = handed_over(old, new)
    assert "new has not taken its place" in old.must_stay(0.0)
    old.look(seen("new", now_s=0.1))
    assert "are still to be answered" in old.must_stay(0.1)
    play(old, range(10, fence.seq))
    assert old.must_stay(0.1) == ""
    assert not old.is_to_leave(LEAVE_AFTER_S)
    assert old.is_to_leave(LEAVE_AFTER_S + 0.2)


def test_a_frame_ahead_is_named_also_when_the_run_in_which_the_place_was_taken_is_long_forgotten():
    """A place that was taken 17 loops of a clip ago was given on with the frame of then: both answered until the next loop."""
    voice = Voice(standing_by=True)
    voice.answers(FrameId(1, 0), 0.0)
    voice.ask("old", 0.0)
    assert voice.take(FrameId(1, 10), 0.1)
    now_s = 1.0
    for run in range(1, 40):
        for seq in range(20):
            voice.answers(FrameId(run, seq), now_s)
            now_s += 0.03
    fence = voice.yield_to("new", now_s)
    assert fence == FrameId(39, 20 + LEAD_FRAMES)
    assert voice.answers(FrameId(39, 20), now_s)
    assert not voice.answers(FrameId(39, 20 + LEAD_FRAMES), now_s)
    assert not voice.answers(FrameId(40, 0), now_s)
