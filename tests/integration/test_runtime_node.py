"""A stage on a real router: what it hears, answers and says of itself."""

import dataclasses
import json
import signal
import subprocess
import sys
import threading
import time

import pytest
from deixis_runtime.session import Unreachable, open_client
from deixis_runtime.settings import CommonOptions
from deixis_runtime.stage import Node
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, Health, Poi, Track, Tracks
from deixis_schemas.samples import FRAME


@pytest.fixture
def endpoint(free_port, wait_for):
    endpoint = f"tcp/127.0.0.1:{free_port}"
    process = subprocess.Popen([sys.executable, "-m", "deixis_runtime.router", "--listen", endpoint])

    def answers():
        try:
            with open_client(endpoint, shared_memory=False):
                return True
        except Unreachable:
            return False

    wait_for(answers, "the router listens")
    yield endpoint
    process.terminate()
    assert process.wait(10) == 0


@pytest.fixture
def peer(endpoint):
    """A session that is not of our making."""
    with open_client(endpoint, shared_memory=False) as session:
        yield session


@pytest.fixture
def node(endpoint, robot):
    with open_client(endpoint, shared_memory=False) as session:
        yield Node(session, "tracker", CommonOptions(robot, "t-1", endpoint, False, False, 0, None, ()))


@pytest.fixture
def looping(node):
    """The node's loop on a thread, until the test ends."""
    thread = threading.Thread(target=lambda: [None for _ in iter(node.wait, False)])
    yield thread.start
    node.stop()
    thread.join(5)


@pytest.fixture
def put(peer, robot, wait_for):
    """Puts on a topic as a stranger would, once the router knows of the subscriber: before that a put goes nowhere."""

    def send(topic, payload, encoding=None):
        publisher = peer.declare_publisher(topic.key(robot, id="a"), encoding=encoding or codec.encoding_of(topic.type))
        wait_for(lambda: publisher.matching_status.matching, "the subscriber is known")
        publisher.put(payload)
        return publisher

    return send


@pytest.fixture
def waiting(wait_for):
    """Wait until so many samples have been heard by a subscription."""
    return lambda heard, number: wait_for(lambda: heard.received >= number, f"{number} samples")


def health_of(session, robot):
    for reply in session.get(f"deixis/{robot}/tracker/health", timeout=2.0):
        if reply.ok:
            return codec.decode(Health, reply.ok.payload.to_bytes(), str(reply.ok.encoding))
    return None


def test_the_newest_frame_wins_and_the_others_are_counted(node, wait_for, put):
    frames = node.subscribe(topics.FRAME)
    for seq in range(5):
        put(topics.FRAME, codec.encode(FRAME.model_copy(update={"seq": seq})))
    wait_for(lambda: frames.received == 5, "five frames")
    assert frames.take().seq == 4
    assert frames.take() is None
    assert (frames.overwritten, frames.used) == (4, 1)


def test_a_deeper_subscription_keeps_the_last_few_in_order(node, wait_for, put):
    frames = node.subscribe(topics.FRAME, depth=3)
    for seq in range(5):
        put(topics.FRAME, codec.encode(FRAME.model_copy(update={"seq": seq})))
    wait_for(lambda: frames.received == 5, "five frames")
    assert [frame.seq for frame in frames.take_all()] == [2, 3, 4]


@pytest.mark.parametrize(
    ("payload", "encoding", "kind"),
    [
        (b"garbage", None, "malformed"),
        (codec.encode(FRAME), "application/msgpack;Frame/99", "wrong_version"),
        (codec.encode(FRAME), "zenoh/bytes", "wrong_type"),
    ],
)
def test_a_bad_payload_is_counted_and_named_and_a_good_one_still_taken(
    node, robot, waiting, caplog, payload, encoding, kind, put
):
    frames = node.subscribe(topics.FRAME)
    put(topics.FRAME, payload, encoding)
    waiting(frames, 1)
    assert frames.take() is None
    assert (frames.rejected, frames.last_error_kind) == (1, kind)
    assert f"deixis/{robot}/camera/frame: rejected" in caplog.text
    put(topics.FRAME, codec.encode(FRAME))
    waiting(frames, 2)
    assert isinstance(frames.take(), Frame)


def test_health_is_answered_and_advances_while_the_loop_runs(node, peer, robot, looping, wait_for, waiting, put):
    frames = node.subscribe(topics.FRAME)
    put(topics.FRAME, b"garbage")
    waiting(frames, 1)
    frames.take()
    node.count("things", 3)
    looping()
    first = wait_for(lambda: health_of(peer, robot), "health")
    assert first.inputs[0].rejected == 1
    assert "not msgpack" in first.inputs[0].last_error
    assert first.counters == {"things": 3}
    wait_for(lambda: health_of(peer, robot).count > first.count, "the count advances")


@pytest.mark.usefixtures("node")
def test_get_answers_json_when_asked_and_refuses_other_formats(peer, robot, looping, wait_for):
    looping()
    (reply,) = answers(peer, f"deixis/{robot}/*/health?format=json", wait_for)
    assert json.loads(reply.ok.payload.to_bytes())["stage"] == "tracker"
    (reply,) = answers(peer, f"deixis/{robot}/*/health?format=xml", wait_for)
    assert b"format: 'xml'" in reply.err.payload.to_bytes()


def test_a_state_whose_reason_counts_seconds_is_logged_when_it_comes_and_when_it_goes(node, caplog):
    caplog.set_level("INFO")
    for tenth in range(30):
        node.set_state("degraded", f"headpose is dead: gone, silent for {tenth / 10} s")
    node.set_state("ok")
    said = [text for text in caplog.messages if text.startswith(("degraded", "ok"))]
    assert said == ["degraded: headpose is dead: gone, silent for 0.0 s", "ok"]


def test_two_producers_on_one_key_are_noticed_and_said(node, waiting, caplog, put):
    frames = node.subscribe(topics.FRAME)
    for number, instance in enumerate(("one", "two", "one"), 1):
        put(topics.FRAME, codec.encode(FRAME.model_copy(update={"instance": instance})))
        waiting(frames, number)
        frames.take()
    assert frames.producers() == ["camera/one", "camera/two"]
    assert "more than one producer: camera/one, camera/two" in caplog.text


def test_a_producer_that_was_replaced_is_no_second_producer(node, waiting, put):
    frames = node.subscribe(topics.FRAME)
    for number, instance in enumerate(("old", "old", "new", "new"), 1):
        put(topics.FRAME, codec.encode(FRAME.model_copy(update={"instance": instance})))
        waiting(frames, number)
        frames.take()
    assert frames.producers() == ["camera/new"]


def test_edits_are_kept_in_their_order(node, robot, wait_for, put):
    edits = node.subscribe_edits(topics.POI.key(robot, id="*"))
    put(topics.POI, b'{"x": 1}').delete()
    heard = []
    wait_for(lambda: heard.extend(edits.take(1000)) or len(heard) == 2, "two edits")
    assert [(edit.kind, edit.payload) for edit in heard] == [("put", b'{"x": 1}'), ("delete", b"")]


@pytest.mark.usefixtures("node")
def test_the_token_stands_only_when_the_loop_runs(peer, robot, looping, wait_for):
    def alive():
        replies = peer.liveliness().get(topics.alive_key(robot, "*", "*"), timeout=2.0)
        return [str(reply.ok.key_expr) for reply in replies if reply.ok]

    assert alive() == []
    looping()
    wait_for(lambda: alive() == [topics.alive_key(robot, "tracker", "t-1")], "the token")


def test_a_publisher_refuses_messages_of_another_type(node):
    publisher = node.publish(topics.TRACKS)
    with pytest.raises(TypeError, match="carries Tracks, not Poi"):
        publisher.put(Poi(poi_id="a", position_m=(0, 0, 0)))
    publisher.put(Tracks.derive(FRAME, node.producer, width=1, height=1))
    assert publisher.published == 1


def test_a_client_without_a_router_fails_to_start_and_names_the_endpoint(free_port):
    with pytest.raises(Unreachable, match=f"tcp/127.0.0.1:{free_port}"), open_client(f"tcp/127.0.0.1:{free_port}"):
        pass


def test_a_delete_on_a_stream_is_a_counted_rejection(node, waiting, put):
    frames = node.subscribe(topics.FRAME)
    publisher = put(topics.FRAME, codec.encode(FRAME))
    waiting(frames, 1)
    frames.take()
    publisher.delete()
    waiting(frames, 2)
    assert frames.take() is None
    assert "a delete" in frames.last_error


def test_old_frames_that_a_cut_link_gives_out_late_are_not_used(node, robot, peer, waiting, wait_for, caplog):
    frames = node.subscribe(topics.FRAME, depth=32)
    publisher = peer.declare_publisher(topics.FRAME.key(robot), encoding=codec.encoding_of(Frame))
    wait_for(lambda: publisher.matching_status.matching, "the subscriber is known")
    now_ns = time.time_ns() + 300 * 10**9  # the camera's clock is five minutes ahead of ours

    def send(seq, stamp_ns):
        publisher.put(codec.encode(FRAME.model_copy(update={"seq": seq, "stamp_ns": stamp_ns})))

    send(0, now_ns)
    waiting(frames, 1)
    assert [frame.seq for frame in frames.take_all()] == [0]
    time.sleep(2.0)  # the link is cut: what was made meanwhile comes at once
    for seq in range(1, 21):
        send(seq, now_ns + seq * 10**8)
    waiting(frames, 21)
    seqs = [frame.seq for frame in frames.take_all()]
    assert seqs == list(range(seqs[0], 21))
    assert 10 < seqs[0] <= 15
    assert frames.too_old == frames.health().too_old == seqs[0] - 1
    assert f"deixis/{robot}/camera/frame: dropped" in caplog.text


def test_a_key_of_which_all_is_too_old_is_noted_in_health(node, robot, peer, put, looping, waiting, wait_for):
    frames = node.subscribe(topics.FRAME)
    put(topics.FRAME, codec.encode(FRAME))
    waiting(frames, 1)
    assert frames.take() is not None
    time.sleep(1.2)
    looping()

    def notes():
        put(topics.FRAME, codec.encode(FRAME.model_copy(update={"seq": FRAME.seq + frames.received})))
        assert frames.take() is None
        return health_of(peer, robot).notes

    assert wait_for(notes, "a note") == [f"deixis/{robot}/camera/frame: all that comes is too old and is dropped"]


def test_a_burst_of_edits_is_heard_whole(node, robot, peer, wait_for):
    edits = node.subscribe_edits(topics.POI.key(robot, id="**"))
    publisher = peer.declare_publisher(topics.POI.key(robot, id="p0"))
    wait_for(lambda: publisher.matching_status.matching, "the subscriber is known")
    for number in range(300):
        peer.put(topics.POI.key(robot, id=f"p{number}"), b"%d" % number)
    heard = []
    wait_for(lambda: heard.extend(edits.take(1000)) or len(heard) >= 300, "all edits")
    assert [int(edit.payload) for edit in heard] == list(range(300))
    assert edits.lost == 0


def test_lost_edits_are_counted_in_health(node, peer, robot, looping, wait_for):
    edits = node.subscribe_edits(topics.POI.key(robot, id="**"))
    edits.lost = 7
    looping()
    wait_for(lambda: (health := health_of(peer, robot)) and health.counters == {"edits_lost": 7}, "the counter")


def test_what_is_larger_than_its_topic_allows_is_not_published_but_counted_and_said(node, robot, caplog):
    small = dataclasses.replace(topics.TRACKS, max_bytes=300)
    publisher = node.publish(small)
    publisher.put(Tracks.derive(FRAME, node.producer, width=1, height=1))
    crowd = Tracks.derive(FRAME, node.producer, width=1, height=1, tracks=[track() for _ in range(10)])
    publisher.put(crowd)
    assert (publisher.published, publisher.oversized, publisher.health().oversized) == (1, 1, 1)
    assert f"deixis/{robot}/tracker/tracks: not published: {len(codec.encode(crowd))} bytes, more than the 300" in caplog.text


def track():
    content = {"track_id": 0, "kind": "face", "kind_probabilities": {}, "centroid_px": (0, 0), "velocity_px_s": (0, 0)}
    return Track.model_validate(content | {"bbox_px": (0, 0, 1, 1)})


def answers(peer, selector, wait_for):
    """Replies to a get, once there are any: a get before the queryable is known to the peer ends at once, without a reply."""
    return wait_for(lambda: list(peer.get(selector, timeout=5.0)), f"an answer to {selector}")


def test_a_reply_that_is_too_large_is_an_error_that_says_how_to_ask(node, peer, robot, looping, wait_for):
    small = dataclasses.replace(topics.STATE, max_bytes=10)
    node.serve_get(small, lambda _: [(topics.STATE.key(robot), FRAME)])
    looping()
    (reply,) = answers(peer, topics.STATE.key(robot), wait_for)
    assert reply.ok is None
    assert "more than the 10 that 'fusion/state' allows; ask for less, with ?top=N or ?poi=ID" in reply.err.payload.to_string()


def test_a_signal_handler_may_stop_a_stage_whatever_the_loop_holds_at_that_moment(node):
    with node._event._cond:  # as in the midst of Event.wait
        node.stop()
    assert not node.wait()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_router_stops_fast_on_a_signal(free_port, number):
    argv = [sys.executable, "-m", "deixis_runtime.router", "--listen", f"tcp/127.0.0.1:{free_port}"]
    with subprocess.Popen(argv, stderr=subprocess.PIPE, text=True) as router:
        assert "listening" in router.stderr.readline()
        began_s = time.monotonic()
        router.send_signal(number)
        assert router.wait(10) == 0
        assert time.monotonic() - began_s < 2.0
