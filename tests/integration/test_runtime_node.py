"""A stage on a real router: what it hears, answers and says of itself."""

import json
import subprocess
import sys
import threading

import pytest
from deixis_runtime.session import Unreachable, open_client
from deixis_runtime.settings import CommonOptions
from deixis_runtime.stage import Node
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, Health, Poi, Tracks
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
        yield Node(session, "tracker", CommonOptions(robot, "t-1", endpoint, False, False, None, ()))


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
        (codec.encode(FRAME), "application/msgpack;Frame/2", "wrong_version"),
        (codec.encode(FRAME), "zenoh/bytes", "wrong_type"),
    ],
)
def test_a_bad_payload_is_counted_and_named_and_a_good_one_still_taken(
    node, robot, wait_for, caplog, payload, encoding, kind, put
):
    frames = node.subscribe(topics.FRAME)
    put(topics.FRAME, payload, encoding)
    wait_for(frames.pending, "the bad payload")
    assert frames.take() is None
    assert (frames.rejected, frames.last_error_kind) == (1, kind)
    assert f"deixis/{robot}/camera/frame: rejected" in caplog.text
    put(topics.FRAME, codec.encode(FRAME))
    wait_for(frames.pending, "the good one")
    assert isinstance(frames.take(), Frame)


def test_health_is_answered_and_advances_while_the_loop_runs(node, peer, robot, looping, wait_for, put):
    frames = node.subscribe(topics.FRAME)
    put(topics.FRAME, b"garbage")
    wait_for(frames.pending, "the bad payload")
    frames.take()
    node.count("things", 3)
    looping()
    first = wait_for(lambda: health_of(peer, robot), "health")
    assert first.inputs[0].rejected == 1
    assert "not msgpack" in first.inputs[0].last_error
    assert first.counters == {"things": 3}
    wait_for(lambda: health_of(peer, robot).count > first.count, "the count advances")


@pytest.mark.usefixtures("node")
def test_get_answers_json_when_asked_and_refuses_other_formats(peer, robot, looping):
    looping()
    reply = next(iter(peer.get(f"deixis/{robot}/*/health?format=json", timeout=5.0)))
    assert json.loads(reply.ok.payload.to_bytes())["stage"] == "tracker"
    reply = next(iter(peer.get(f"deixis/{robot}/*/health?format=xml", timeout=5.0)))
    assert b"format: 'xml'" in reply.err.payload.to_bytes()


def test_two_producers_on_one_key_are_noticed_and_said(node, wait_for, caplog, put):
    frames = node.subscribe(topics.FRAME)
    for instance in ("one", "two", "one"):
        put(topics.FRAME, codec.encode(FRAME.model_copy(update={"instance": instance})))
        wait_for(frames.pending, "a frame")
        frames.take()
    assert frames.producers() == ["camera/one", "camera/two"]
    assert "more than one producer: camera/one, camera/two" in caplog.text


def test_a_producer_that_was_replaced_is_no_second_producer(node, wait_for, put):
    frames = node.subscribe(topics.FRAME)
    for instance in ("old", "old", "new", "new"):
        put(topics.FRAME, codec.encode(FRAME.model_copy(update={"instance": instance})))
        wait_for(frames.pending, "a frame")
        frames.take()
    assert frames.producers() == ["camera/new"]


def test_edits_are_kept_in_their_order(node, robot, wait_for, put):
    edits = node.subscribe_edits(topics.POI.key(robot, id="*"))
    put(topics.POI, b'{"x": 1}').delete()
    heard = []
    wait_for(lambda: heard.extend(edits.take_all()) or len(heard) == 2, "two edits")
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


def test_a_delete_on_a_stream_is_a_counted_rejection(node, wait_for, put):
    frames = node.subscribe(topics.FRAME)
    publisher = put(topics.FRAME, codec.encode(FRAME))
    wait_for(frames.pending, "the frame")
    frames.take()
    publisher.delete()
    wait_for(frames.pending, "the delete")
    assert frames.take() is None
    assert "a delete" in frames.last_error
