"""Between who hears and who draws: who draws slowly, or not at all, holds nobody up and fills no memory."""

import time
import tracemalloc

from deixis_cli.raw_message import RawMessage
from deixis_schemas import codec, topics
from deixis_schemas.samples import SAMPLES
from deixis_view.drawer import Drawer, Painter
from deixis_view.feed import MAX_OTHERS, MAX_PICTURE_BYTES, MAX_PICTURES, Feed
from deixis_view.known import Known
from deixis_view.scene import Scene
from stuck_viewer import StuckSink

FRAME_KEY = topics.FRAME.key("r1")
TRACKS_KEY = topics.TRACKS.key("r1")
VGA_BYTES = 640 * 480 * 3


def raw(key, payload=b"", number=0):
    return RawMessage(key, "", payload, number)


def drained(feed):
    return list(iter(lambda: feed.take(0), None))


def test_messages_come_out_in_the_order_in_which_they_came():
    feed = Feed()
    for number, key in enumerate((TRACKS_KEY, FRAME_KEY, TRACKS_KEY, FRAME_KEY)):
        feed.put(raw(key, number=number))
    assert [message.received_ns for message in drained(feed)] == [0, 1, 2, 3]
    assert feed.take(0) is None
    assert feed.left_out == 0


def test_past_the_bounds_the_oldest_go_pictures_apart_from_all_else():
    feed = Feed()
    for number in range(MAX_PICTURES + 5):
        feed.put(raw(FRAME_KEY, number=number))
    for number in range(MAX_OTHERS + 3):
        feed.put(raw(TRACKS_KEY, number=number))
    assert feed.left_out == 8
    held = drained(feed)
    assert next(message.received_ns for message in held if message.key == FRAME_KEY) == 5
    assert next(message.received_ns for message in held if message.key == TRACKS_KEY) == 3


def test_large_pictures_are_bounded_by_their_bytes():
    feed = Feed()
    for number in range(10):
        feed.put(raw(FRAME_KEY, bytes(MAX_PICTURE_BYTES // 3), number))
    assert [message.received_ns for message in drained(feed)] == [7, 8, 9]


def test_a_viewer_that_is_stuck_holds_nobody_up_and_fills_no_memory():
    feed, sink = Feed(), StuckSink()
    drawer = Drawer(feed, Painter(Scene(Known()), sink), end_s=0.1)
    slowest_s = 0.0
    sample = next(message for message in SAMPLES if type(message) is topics.BELIEF.type)
    belief = RawMessage(topics.BELIEF.key("r1"), codec.encoding_of(type(sample)), codec.encode(sample), 0)
    with drawer:
        feed.put(belief)
        assert sink.entered.wait(10)
        tracemalloc.start()
        for number in range(900):  # half a minute of a camera, 830 MB
            payload = bytes(VGA_BYTES)
            began_s = time.perf_counter()
            feed.put(raw(FRAME_KEY, payload, number))
            for _ in range(4):
                feed.put(raw(TRACKS_KEY, bytes(9000), number))
            slowest_s = max(slowest_s, time.perf_counter() - began_s)
        held, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert not drawer.done  # leaving did not wait for it
    assert held < MAX_PICTURES * VGA_BYTES + MAX_OTHERS * 9200 + (4 << 20)
    assert peak < held + 2 * VGA_BYTES
    assert slowest_s < 0.5  # of thirty frames a second; a put takes microseconds, but the machine may be busy
    assert feed.left_out >= 900 - MAX_PICTURES
    sink.let_go.set()
    assert sink.drawn <= 1


def test_what_breaks_the_contract_is_counted_and_the_rest_is_drawn():
    sink = StuckSink()
    sink.let_go.set()
    painter = Painter(Scene(Known()), sink)
    for message in SAMPLES:
        topic = next(topic for topic in topics.TOPICS if topic.type is type(message))
        key = topic.key("r1", stage="camera", id="vase")
        painter.take(RawMessage(key, codec.encoding_of(type(message)), codec.encode(message), message.VERSION * 10**9))
    assert painter.rejected == 0
    painter.take(RawMessage(TRACKS_KEY, "zenoh/bytes", b"\x00garbage", 0))
    painter.take(RawMessage("deixis/r1/of/no/contract", "text/plain", b"hello", 0))
    painter.take(RawMessage(topics.POI.key("r1", id="vase"), "application/json", b'{"position_m": [1, 2, 0]}', 0))
    assert painter.rejected == 2
    assert sink.drawn >= 1
