"""What is kept of everything that a robot publishes."""

from types import SimpleNamespace

import zenoh
from deixis_cli.inbox import MAX_FRAMES, Inbox
from deixis_schemas import codec
from deixis_schemas.samples import FRAME, SAMPLES

TRACKS = next(message for message in SAMPLES if type(message).__name__ == "Tracks")


def sample(key, message=None, encoding=None, payload=b"", kind=zenoh.SampleKind.PUT):
    if message is not None:
        payload, encoding = codec.encode(message), codec.encoding_of(type(message))
    return SimpleNamespace(
        key_expr=f"deixis/r1/{key}",
        encoding=encoding or "zenoh/bytes",
        kind=kind,
        payload=SimpleNamespace(to_bytes=lambda: payload),
    )


def test_messages_come_out_in_the_order_they_came_in():
    inbox = Inbox()
    for seq in range(5):
        inbox.store(sample("camera/frame", FRAME.model_copy(update={"seq": seq})))
        inbox.store(sample("tracker/tracks", TRACKS.model_copy(update={"seq": seq})))
    taken = inbox.take_all()
    assert [(item.topic.path, item.message.seq) for item in taken] == [
        (path, seq) for seq in range(5) for path in ("camera/frame", "tracker/tracks")
    ]
    assert inbox.take_all() == []


def test_frames_nobody_takes_are_bounded_the_oldest_going_first_and_counted():
    inbox = Inbox()
    inbox.store(sample("tracker/tracks", TRACKS))
    for seq in range(MAX_FRAMES + 3):
        inbox.store(sample("camera/frame", FRAME.model_copy(update={"seq": seq})))
    taken = inbox.take_all()
    assert inbox.lost == 3
    assert taken[0].topic.path == "tracker/tracks"
    assert [item.message.seq for item in taken[1:]] == list(range(3, MAX_FRAMES + 3))


def test_what_breaks_the_contract_is_counted_with_its_cause_and_left_out():
    inbox = Inbox()
    inbox.store(sample("tracker/tracks", payload=b"\xff\x00", encoding=codec.encoding_of(type(TRACKS))))
    inbox.store(sample("tracker/tracks", FRAME))
    inbox.store(sample("some/other/key", payload=b"x"))
    assert inbox.take_all() == []
    assert inbox.rejected == 3
    assert inbox.rejections["deixis/r1/some/other/key"] == "a key outside the contract"
    assert "expected 'application/msgpack;Tracks/2'" in inbox.rejections["deixis/r1/tracker/tracks"]


def test_a_delete_is_taken_without_a_message():
    inbox = Inbox()
    inbox.store(sample("fusion/poi/door", kind=zenoh.SampleKind.DELETE))
    assert [(item.key, item.message) for item in inbox.take_all()] == [("deixis/r1/fusion/poi/door", None)]
