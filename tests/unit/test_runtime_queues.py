"""Edits and gets that wait for the loop are bounded, and what is lost is counted; steps are those of the last second."""

import threading
import time
import weakref
from types import SimpleNamespace

import pytest
import zenoh
from deixis_runtime import inputs, queries
from deixis_runtime.heartbeat import StepTimes
from deixis_runtime.inputs import Subscription
from deixis_runtime.queries import EditQueue, QueryQueue
from deixis_schemas import codec, topics
from deixis_schemas.messages import Poi, State
from deixis_schemas.samples import FRAME
from zenoh import Parameters, SampleKind, ZBytes

POI = Poi(poi_id="a", position_m=(1, 2, 3))


class Log:
    """Takes warnings."""

    def __init__(self):
        self.said = []

    def __call__(self, _kind, text):
        self.said.append(text)


@pytest.fixture
def log():
    return Log()


def no_wake():
    """Nobody waits."""


def put(number, size=10):
    payload = type("Payload", (), {"to_bytes": lambda _: b"%d" % number, "__len__": lambda _: size})()
    return SimpleNamespace(key_expr=f"deixis/r1/fusion/poi/p{number}", kind=SampleKind.PUT, payload=payload, encoding="x")


def test_a_burst_of_edits_is_kept_whole_and_in_its_order(log):
    queue = EditQueue("deixis/r1/fusion/poi/**", no_wake, log)
    for number in range(5000):
        queue.store(put(number))
    assert [int(edit.payload) for edit in queue.take(queries.MAX_EDITS)] == list(range(5000))
    assert (queue.lost, log.said) == (0, [])


def test_past_the_bound_the_newest_edits_are_lost_counted_and_said_once(log, monkeypatch):
    monkeypatch.setattr(queries, "MAX_EDITS", 100)
    queue = EditQueue("deixis/r1/fusion/poi/**", no_wake, log)
    for number in range(103):
        queue.store(put(number))
    assert [int(edit.payload) for edit in queue.take(queries.MAX_EDITS)] == list(range(100))
    assert queue.lost == 3
    queue.store(put(7))
    assert len(queue.take(queries.MAX_EDITS)) == 1, "there is room again"
    assert len(log.said) == 1
    assert "deixis/r1/fusion/poi/**: 3 edits lost" in log.said[0]


def test_edits_are_bounded_by_their_bytes_too(log):
    queue = EditQueue("deixis/r1/fusion/poi/**", no_wake, log)
    for number in range(40):
        queue.store(put(number, size=1 << 20))
    assert len(queue.take(queries.MAX_EDITS)) == 32
    assert queue.lost == 8
    queue.store(put(1, size=1 << 20))
    assert len(queue.take(queries.MAX_EDITS)) == 1


class Asked:
    """A get, and what is replied to it."""

    def __init__(self, parameters=""):
        self.key_expr, self.payload, self.encoding = "deixis/r1/fusion/state", None, None
        self.parameters = Parameters(parameters)
        self.replies, self.errors, self.dropped = [], [], False

    def reply(self, key, payload, encoding):
        self.replies.append((key, payload, encoding))

    def reply_err(self, payload, **_):
        self.errors.append(payload.decode())

    def drop(self):
        self.dropped = True


def answered(topic, message, log, parameters=""):
    queue = QueryQueue(topic, lambda _: [("deixis/r1/fusion/state", message)], no_wake, log)
    asked = Asked(parameters)
    queue.store(asked)
    assert not queue.answer_until(time.monotonic() + 5)
    assert asked.dropped
    return asked


@pytest.mark.parametrize("parameters", ["", "format=json"])
def test_a_reply_that_is_too_large_becomes_an_error_that_says_how_to_ask(log, parameters):
    pois = [Poi(poi_id=f"p{n}", name="x" * 2000, position_m=(0, 0, 0), tags=["y" * 64] * 32) for n in range(1024)]
    state = State(stamp_ns=1, stage="fusion", instance="a", robot="r1", sources=[], pois=pois, persons=[])
    assert len(codec.encode(state)) > topics.STATE.max_bytes
    asked = answered(topics.STATE, state, log, parameters)
    assert asked.replies == []
    (error,) = asked.errors
    assert str(topics.STATE.max_bytes) in error
    assert "?top=N or ?poi=ID" in error
    assert "deixis/r1/fusion/state" in log.said[0]


def test_a_reply_of_more_than_a_mebibyte_is_sent_where_the_topic_allows_it(log):
    pois = [Poi(poi_id=f"p{n}", name="x" * 2000, position_m=(0, 0, 0)) for n in range(1000)]
    state = State(stamp_ns=1, stage="fusion", instance="a", robot="r1", sources=[], pois=pois, persons=[])
    asked = answered(topics.STATE, state, log)
    assert len(asked.replies[0][1]) > 1 << 20
    assert asked.errors == []


def test_gets_past_the_bound_are_counted(log):
    queue = QueryQueue(topics.STATE, lambda _: [], no_wake, log)
    for _ in range(queries.MAX_WAITING + 2):
        queue.store(Asked())
    assert queue.lost == 2


def test_gets_that_crowded_others_out_are_answered_and_the_others_refused_in_words(log):
    queue = QueryQueue(topics.POI, lambda _: [("deixis/r1/fusion/poi/a", POI)], no_wake, log)
    asked = [Asked() for _ in range(queries.MAX_WAITING + 3)]
    for one in asked:
        queue.store(one)
    assert not queue.answer_until(time.monotonic() + 5)
    assert [one.errors for one in asked[:3]] == [[f"busy: more than {queries.MAX_WAITING} gets wait"]] * 3
    assert all(len(one.replies) == 1 for one in asked[3:])
    assert all(one.dropped for one in asked)


def test_past_its_time_one_reply_is_given_and_the_rest_when_it_is_called_again(log):
    keys = [f"deixis/r1/fusion/poi/p{number}" for number in range(3)]
    queue = QueryQueue(topics.POI, lambda _: [(key, POI) for key in keys], no_wake, log)
    first, second = Asked(), Asked()
    queue.store(first)
    queue.store(second)
    for replies, over in ((1, False), (2, False), (3, True)):
        assert queue.answer_until(0.0), "there is more to do"
        assert (len(first.replies), first.dropped) == (replies, over)
    while queue.answer_until(0.0):
        pass
    assert [key for key, *_ in first.replies] == [key for key, *_ in second.replies] == keys
    assert first.dropped
    assert second.dropped


def test_an_asker_that_cannot_be_reached_is_said_and_does_not_stop_the_next(log):
    def gone(*_, **__):
        raise zenoh.ZError("the asker is gone")

    queue = QueryQueue(topics.POI, lambda _: [("deixis/r1/fusion/poi/a", POI)] * 2, no_wake, log)
    first, second = Asked(), Asked()
    first.reply = gone
    queue.store(first)
    queue.store(second)
    assert not queue.answer_until(time.monotonic() + 5)
    assert (first.dropped, len(second.replies)) == (True, 2)
    assert log.said == ["deixis/r1/fusion/state: cannot reply: the asker is gone"]


def test_what_gets_bring_along_is_bounded_by_its_bytes(log):
    queue = QueryQueue(topics.POI, lambda _: [], no_wake, log)
    asked = [Asked() for _ in range(20)]
    for one in asked:
        one.payload = ZBytes(bytes(1 << 20))
        queue.store(one)
    assert queue.lost == 4
    queue.answer_until(time.monotonic() + 5)
    assert sum("payload: 1048576 bytes" in "".join(one.errors) for one in asked) == 16
    late = Asked()
    late.payload = ZBytes(bytes(10))
    queue.store(late)
    assert not queue.answer_until(time.monotonic() + 5)
    assert (queue.lost, late.dropped) == (4, True), "there is room again"


def test_of_many_edits_so_many_are_taken_at_once_in_their_order_and_the_loop_is_woken_for_the_rest(log):
    woken = []
    queue = EditQueue("deixis/r1/fusion/poi/**", lambda: woken.append(True), log)
    for number in range(5):
        queue.store(put(number))
    woken.clear()
    assert [int(edit.payload) for edit in queue.take(3)] == [0, 1, 2]
    assert len(woken) == 1
    assert [int(edit.payload) for edit in queue.take(3)] == [3, 4]
    assert len(woken) == 1


def frame_sample(seq, stamp_ns, run=FRAME.run):
    payload = codec.encode(FRAME.model_copy(update={"run": run, "seq": seq, "stamp_ns": stamp_ns}))
    key = topics.FRAME.key("r1")
    return SimpleNamespace(
        key_expr=key, kind=SampleKind.PUT, payload=ZBytes(payload), encoding=codec.encoding_of(topics.FRAME.type)
    )


class Clock:
    """Our monotonic clock, set by hand."""

    def __init__(self):
        self.now_s = 100.0

    def monotonic(self):
        return self.now_s

    def monotonic_ns(self):
        return round(self.now_s * 1e9)


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(inputs, "time", clock)
    return clock


def frames_and_link(log, **options):
    """A subscription, and a function that delivers frame `seq`, captured `after_s` seconds after the first, at once."""
    frames = Subscription(topics.FRAME, "deixis/r1/camera/frame", 8, no_wake, log, **options)
    return frames, lambda seq, after_s: frames.store(frame_sample(seq, 10**18 + round(after_s * 1e9)))


def test_old_messages_are_dropped_counted_and_said(log, clock):
    frames, deliver = frames_and_link(log)
    deliver(0, 0.0)
    assert len(frames.take_all()) == 1
    clock.now_s += 5.0  # the link is cut, and gives all out when it is mended
    for seq in range(1, 6):
        deliver(seq, float(seq))
    assert [frame.seq for frame in frames.take_all()] == [4, 5]
    assert (frames.received, frames.used, frames.too_old) == (6, 3, 3)
    assert frames.health().too_old == 3
    assert log.said == ["deixis/r1/camera/frame: dropped, 4.0 s old; the limit is 1 s"]


def test_that_all_of_a_key_is_too_old_is_told_and_taken_back(log, clock):
    frames, deliver = frames_and_link(log)
    deliver(0, 0.0)
    frames.take()
    assert not frames.all_too_old()
    clock.now_s += 5.0
    deliver(1, 3.0)
    assert frames.take() is None
    assert frames.age_s() == 5.0, "what is too old is not accepted"
    assert frames.all_too_old()
    assert not frames.all_too_old(), "nothing came since"
    deliver(2, 3.0)
    deliver(3, 5.0)
    assert frames.take().seq == 3
    assert not frames.all_too_old(), "one was used"


def test_in_lockstep_no_age_is_judged(log, clock):
    frames, deliver = frames_and_link(log, lockstep=True)
    for seq in range(3):
        deliver(seq, 0.0)
        clock.now_s += 60.0
    assert len(frames.take_all()) == 3


def test_what_is_larger_than_its_topic_allows_is_refused_and_not_kept(log):
    tracks = Subscription(topics.TRACKS, topics.TRACKS.key("r1"), 8, no_wake, log)

    class Large(SimpleNamespace):
        """Can be watched for being kept."""

    kept = Large(key_expr=tracks.key, payload=ZBytes(bytes(topics.TRACKS.max_bytes + 1)))
    still_there = weakref.ref(kept)
    tracks.store(kept)
    del kept
    assert still_there() is None
    assert tracks.take_all() == []
    assert (tracks.received, tracks.rejected) == (1, 1)
    assert tracks.health().last_error == "1048577 bytes, more than the 1048576 allowed"
    assert log.said == ["deixis/r1/tracker/tracks: rejected: 1048577 bytes, more than the 1048576 allowed"]


class ClockOfTheCamera:
    """What ClockWatch tells once it has compared: the camera's clock is an hour ahead, give or take 0.1 s."""

    AHEAD_NS = 3600 * 10**9

    def __init__(self):
        self.known = True

    def age_ns(self, stamp_ns, now_ns):
        return now_ns + self.AHEAD_NS - 10**8 - stamp_ns if self.known else None

    def forget(self):
        self.known = False


def hear_frame(frames, clock, seq, age_s, run=1, set_by_s=0.0):
    """A second later a frame comes that was captured `age_s` ago by the camera's clock, which was set by so much."""
    clock.now_s += 1.0
    stamp_ns = round((clock.now_s - age_s + set_by_s) * 1e9) + ClockOfTheCamera.AHEAD_NS
    frames.store(frame_sample(seq, stamp_ns, run))
    return [frame.seq for frame in frames.take_all()]


def test_a_backlog_that_always_was_is_seen_by_the_cameras_clock(log, clock):
    frames = Subscription(topics.FRAME, "deixis/r1/camera/frame", 8, no_wake, log, clock=ClockOfTheCamera())
    assert hear_frame(frames, clock, 0, 0.9) == [0]
    assert hear_frame(frames, clock, 1, 1.05) == [1], "it may be younger than 1 s: the clocks are not known better"
    assert hear_frame(frames, clock, 2, 1.2) == []
    assert hear_frame(frames, clock, 0, 4.0, run=2) == [], "a new run, as of a looped recording, changes no clock"
    assert frames.too_old == 2


def test_a_cameras_clock_that_is_set_back_makes_no_frame_old(log, clock):
    frames = Subscription(topics.FRAME, "deixis/r1/camera/frame", 8, no_wake, log, clock=ClockOfTheCamera())
    assert hear_frame(frames, clock, 0, 0.1) == [0]
    assert hear_frame(frames, clock, 1, 0.1, set_by_s=-300.0) == [1]
    assert hear_frame(frames, clock, 2, 0.1, set_by_s=-300.0) == [2]
    assert frames.too_old == 0


def test_step_times_are_those_of_the_last_second():
    steps = StepTimes()
    for turn in range(300):
        steps.add(0.5 if turn < 200 else 0.001, turn * 0.01)
    assert max(steps.last_second_ms(3.0)) == pytest.approx(1.0)
    assert len(steps.last_second_ms(3.0)) <= 101
    assert steps.last_second_ms(5.0) == []


def test_queues_may_be_filled_while_they_are_emptied(log):
    queue, heard = EditQueue("deixis/r1/fusion/poi/**", no_wake, log), []
    writer = threading.Thread(target=lambda: [queue.store(put(number)) for number in range(3000)])
    writer.start()
    while writer.is_alive():
        heard += queue.take(queries.MAX_EDITS)
    heard += queue.take(queries.MAX_EDITS)
    assert [int(edit.payload) for edit in heard] == list(range(3000))
