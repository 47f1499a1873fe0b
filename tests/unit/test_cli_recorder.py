"""Lines of a recording."""

import json

import pytest
from deixis_cli.inbox import Received, read_message
from deixis_cli.recorder import Recorder, RecorderError, line_of
from deixis_schemas import codec, topics
from deixis_schemas.samples import SAMPLES

TOPIC_OF = {topic.type: topic for topic in topics.TOPICS}


def received(message, key="deixis/r1/x/y"):
    return Received(key, TOPIC_OF[type(message)], message, 77)


@pytest.mark.parametrize("message", SAMPLES, ids=lambda message: type(message).__name__)
def test_each_type_becomes_one_line_with_the_promised_fields(message):
    line = line_of(received(message))
    assert line.endswith("\n")
    assert line.count("\n") == 1
    entry = json.loads(line)
    assert list(entry) == ["key", "type", "seq", "stamp_ns", "received_ns", "message"]
    assert (entry["key"], entry["type"], entry["received_ns"]) == ("deixis/r1/x/y", type(message).__name__, 77)
    assert entry["seq"] == getattr(message, "seq", None)
    assert entry["stamp_ns"] == getattr(message, "stamp_ns", None)
    assert "data" not in entry["message"]


def test_a_recorded_message_is_the_message():
    for message in SAMPLES:
        if type(message).__name__ != "Frame":
            content = json.loads(line_of(received(message)))["message"]
            assert type(message).model_validate_json(json.dumps(content)) == message


def test_a_frame_is_read_without_its_image_bytes():
    frame = next(message for message in SAMPLES if type(message).__name__ == "Frame")
    read = read_message(topics.FRAME, topics.FRAME.key("r1"), codec.encode(frame), codec.encoding_of(type(frame)))
    assert read == frame.model_copy(update={"data": b""})


def test_a_poi_is_read_as_generic_clients_put_it():
    poi = read_message(topics.POI, topics.POI.key("r1", id="door"), b'{"position_m": [1, 2, 3]}', "application/json")
    assert (poi.poi_id, poi.position_m) == ("door", (1, 2, 3))


def test_a_deleted_key_is_recorded_with_no_message():
    entry = json.loads(line_of(Received("deixis/r1/fusion/poi/door", topics.POI, None, 77)))
    assert (entry["type"], entry["seq"], entry["message"]) == ("Poi", None, None)


def test_a_recording_goes_to_a_file_of_its_name_in_a_new_folder(tmp_path):
    with Recorder(tmp_path / "a" / "b", "clip") as recorder:
        for message in SAMPLES:
            recorder.write(received(message))
    assert len((tmp_path / "a" / "b" / "clip.jsonl").read_text().splitlines()) == len(SAMPLES)


def test_a_folder_that_cannot_be_made_is_an_error_that_names_it(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RecorderError, match=r"--out .*file"):
        Recorder(tmp_path / "file", "clip")
