"""Recordings as MCAP files: what is written is read as it was sent; a cut file gives what it holds, a damaged one is named."""

import json
from pathlib import Path

import pytest
from deixis_cli.mcap_file import McapFileError, McapReader, McapRecorder, keys_in
from deixis_cli.raw_message import RawMessage
from deixis_schemas import codec, topics
from deixis_schemas.samples import SAMPLES
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

TOPIC_OF = {topic.type: topic for topic in topics.TOPICS}


def raw(message, at_ns):
    key = TOPIC_OF[type(message)].key("r1", stage="tracker", id="door")
    return RawMessage(key, codec.encoding_of(type(message)), codec.encode(message), at_ns)


SENT = [raw(message, 1_000 + i) for i, message in enumerate(SAMPLES)]


def written(path, messages):
    with McapRecorder(path) as recorder:
        for message in messages:
            recorder.write(message)
    return path


def test_what_is_read_is_what_was_sent_also_what_breaks_the_contract(tmp_path):
    sent = [
        *SENT,
        RawMessage("deixis/r1/fusion/poi/door", "", b"", 5_000, deleted=True),
        RawMessage("deixis/r1/fusion/poi/door", "application/json", b'{"position_m": [1, 2, 0]}', 5_001),
        RawMessage("deixis/r1/tracker/tracks", "zenoh/bytes", b"\x00garbage", 5_002),
        RawMessage("deixis/r1/of/no/contract", "text/plain", b"hello", 5_003),
    ]
    reader = McapReader(written(tmp_path / "a.mcap", sent))
    assert list(reader) == sent
    assert (reader.cut, reader.cut_off) == (False, "")


@given(
    st.lists(
        st.builds(
            RawMessage,
            key=st.sampled_from([message.key for message in SENT]),
            encoding=st.sampled_from(["", "application/json", "application/msgpack;Tracks/2", "a;b=c"]),
            payload=st.binary(max_size=300),
            received_ns=st.integers(0, 2**63 - 1),
        ),
        max_size=20,
    )
)
def test_any_messages_come_back(tmp_path_factory, sent):
    path = written(tmp_path_factory.mktemp("any") / "a.mcap", sent)
    assert list(McapReader(path)) == sent
    assert keys_in(path) == {message.key for message in sent}


def test_each_type_has_its_json_schema_and_its_encoding_for_tools_that_know_nothing_of_us(tmp_path):
    with written(tmp_path / "a.mcap", SENT).open("rb") as file:
        summary = make_reader(file).get_summary()
    for channel in summary.channels.values():
        topic = topics.topic_of(channel.topic)
        schema = summary.schemas[channel.schema_id]
        assert channel.message_encoding == "msgpack"
        assert (schema.name, schema.encoding) == (f"{topic.type.__name__}/{topic.version}", "jsonschema")
        assert json.loads(schema.data)["$id"] == schema.name


def test_a_file_cut_anywhere_gives_the_messages_before_the_cut(tmp_path):
    # Each longer than a chunk, so that the file has several.
    sent = [RawMessage("deixis/r1/camera/frame", "x", bytes([i]) * 300_000, i) for i in range(6)]
    whole = written(tmp_path / "a.mcap", sent).read_bytes()
    assert len(whole) > 1000
    seen = set()
    for length in range(60, len(whole), 37):
        path = tmp_path / "cut.mcap"
        path.write_bytes(whole[:length])
        reader = McapReader(path)
        read = list(reader)
        assert reader.cut
        assert reader.cut_off == f"'{path}' was cut off while it was written; what it holds is used"
        assert read == sent[: len(read)]
        assert keys_in(path) == {message.key for message in read}
        seen.add(len(read))
    assert seen == set(range(7))


def test_a_flipped_byte_in_a_message_is_noticed(tmp_path):
    path = written(tmp_path / "a.mcap", SENT)
    content = bytearray(path.read_bytes())
    content[200] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(McapFileError, match=r"a\.mcap.*damaged"):
        list(McapReader(path))


@pytest.mark.parametrize("content", [b"", b"no recording", b"\x89MCAP0\r\n" + b"\xff" * 100])
def test_what_is_no_recording_is_refused_by_name(tmp_path, content):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    for read in (lambda: list(McapReader(path)), lambda: keys_in(path)):
        with pytest.raises(McapFileError, match=r"x\.mcap"):
            read()


def test_a_missing_file_and_a_folder_are_refused_by_name(tmp_path):
    for path in (tmp_path / "none.mcap", tmp_path):
        with pytest.raises(McapFileError, match=path.name):
            list(McapReader(path))
    with pytest.raises(McapFileError, match=r"a\.mcap"):
        McapRecorder(Path("/proc/a.mcap"))


def test_a_recording_is_never_written_over(tmp_path):
    path = written(tmp_path / "a.mcap", SENT)
    with pytest.raises(McapFileError, match=r"a\.mcap' exists already"):
        McapRecorder(path)
    assert list(McapReader(path)) == SENT
