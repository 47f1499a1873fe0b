"""The decoder plug-in of zenoh-cli, without zenoh-cli."""

import json
import subprocess
import sys

import msgpack
import pytest
from deixis_schemas import codec
from deixis_schemas.messages import Frame, Poi, Producer, RobotPose, Tracks
from deixis_schemas.zenoh_cli import decode

POI_KEY = "deixis/r1/fusion/poi/vase"
POI = Poi(poi_id="vase", position_m=(1.0, 2.0, 3.0))
FRAME = Frame(stamp_ns=1, stage="camera", instance="a", run=1, seq=7, width=2, height=2, encoding="bgr8", data=bytes(range(12)))


class Key:
    """Stands for Zenoh's KeyExpr: something that prints as a key."""

    def __str__(self):
        return POI_KEY


def test_a_message_is_one_line_of_json_by_the_topic_of_its_key():
    line = decode(Key(), codec.encode(POI))
    assert "\n" not in line
    assert json.loads(line) == POI.model_dump(mode="json")


def test_fields_that_the_reader_does_not_know_are_kept():
    payload = msgpack.packb(
        {**POI.model_dump(), "colour": {"rgb": b"\x00\xff", 3: msgpack.Timestamp(1, 0)}}, strict_types=False
    )
    with pytest.raises(codec.Malformed, match="not msgpack"):
        decode(POI_KEY, payload)
    payload = msgpack.packb({**POI.model_dump(), "colour": {"rgb": b"\x00\xff", "at": msgpack.Timestamp(1, 0)}})
    assert json.loads(decode(POI_KEY, payload))["colour"]["rgb"] == "AP8="


def test_the_image_of_a_frame_is_left_out():
    assert json.loads(decode("deixis/r1/camera/frame", codec.encode(FRAME)))["data"] == "<12 bytes left out>"


def test_other_binary_fields_are_base64():
    track = {
        "track_id": 1, "kind": "face", "kind_probabilities": {"face": 1.0}, "centroid_px": (1, 1), "bbox_px": (0, 0, 2, 2),
        "velocity_px_s": (0, 0), "contour": b"\x01\x00\x02\x00",
    }  # fmt: skip
    tracks = Tracks.derive(FRAME, Producer("tracker", "a"), width=2, height=2, tracks=[track])
    assert json.loads(decode("deixis/r1/tracker/tracks", codec.encode(tracks)))["tracks"][0]["contour"] == "AQACAA=="


def test_a_poi_put_as_json_is_read_too():
    assert json.loads(decode(POI_KEY, codec.encode_json(POI)))["poi_id"] == "vase"


def test_a_deleted_key_is_null():
    assert decode(POI_KEY, b"") == "null"


@pytest.mark.parametrize(
    ("key", "payload", "words"),
    [
        ("deixis/r1/fusion/poi/vase", codec.encode(POI)[:-3], "not msgpack"),
        ("deixis/r1/fusion/poi/vase", b'{"poi_id": "vase"}', "position_m"),
        ("deixis/r1/robot/pose", codec.encode(POI), "stamp_ns"),
        ("elsewhere/state", codec.encode(POI), "not a key of the contract"),
    ],
)
def test_what_breaks_the_contract_is_named_with_its_key(key, payload, words):
    with pytest.raises(codec.CodecError, match=words) as raised:
        decode(key, payload)
    assert key in str(raised.value)


def test_it_does_without_zenoh():
    script = "import sys, deixis_schemas.zenoh_cli; sys.exit('zenoh' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


def test_every_topic_is_printed():
    pose = RobotPose(stamp_ns=1, stage="robot", instance="a", x_m=1, y_m=2, yaw_deg=3)
    assert json.loads(decode("deixis/r1/robot/pose", codec.encode(pose)))["yaw_deg"] == 3
