"""The bridge to ROS 2 on the wire: names, attachments and bytes as rmw_zenoh's documents and recorded messages have them."""

import struct
from contextlib import suppress

import fake_ros
import numpy as np
import pytest
from deixis_ros2.attachment import Attachment, BadAttachment
from deixis_ros2.names import (
    Endpoint,
    NodeName,
    Qos,
    camera_info_beside,
    dds_type,
    endpoint_token,
    global_id,
    is_topic,
    node_name,
    node_token,
    publishers_of,
    read_publisher,
    topic_key,
)
from deixis_ros2.ros_types import BadCdr, RosTypes, stamp_ns
from hypothesis import given, settings
from hypothesis import strategies as st
from zenoh import KeyExpr
from zenoh.ext import Int64, z_serialize

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
# As published: by rmw_zenoh's design page, and by projects that printed what ROS 2 jazzy says (`ros2 topic info -v`).
PUBLISHED = {
    "std_msgs/msg/String": STRING_HASH,
    "sensor_msgs/msg/Image": "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
    "sensor_msgs/msg/CompressedImage": "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
    "tf2_msgs/msg/TFMessage": "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "sensor_msgs/msg/CameraInfo": "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275",
}
# A recorded tf2_msgs/TFMessage, as in the tests of github.com/foxglove/cdr.
RECORDED_TRANSFORM = bytes.fromhex(
    "0001000001000000cce0d158f08cf9060a000000626173655f6c696e6b000000060000007261646172000000ae47e17a14ae0e40"
    "00000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000f03f"
)
TRANSFORMS = "tf2_msgs/msg/TFMessage"
JAZZY = RosTypes("jazzy")
TEXTS = st.text(st.characters(codec="ascii", exclude_characters="\0"), max_size=9)


# --- names ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("domain", "topic", "key"),
    [
        (0, "/chatter", f"0/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"),
        (0, "/robot1/chatter", f"0/robot1/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"),
    ],
)
def test_a_topics_key_is_that_of_the_design_page(domain, topic, key):
    assert topic_key(domain, topic, "std_msgs/msg/String", JAZZY.hash_of("std_msgs/msg/String")) == key


def test_tokens_are_those_of_the_design_page():
    session, listener = "aac3178e146ba6f1fc6e6a4085e77f21", NodeName(2, "/", "listener")
    chatter = Endpoint("listener", "/chatter", dds_type("std_msgs/msg/String"), STRING_HASH)
    of_type = f"std_msgs::msg::dds_::String_/{STRING_HASH}"
    assert node_token(session, listener) == f"@ros2_lv/2/{session}/0/0/NN/%/%/listener"
    assert (
        endpoint_token(session, 10, "MS", listener, chatter, Qos(depth=10))
        == f"@ros2_lv/2/{session}/0/10/MS/%/%/listener/%chatter/{of_type}/::,10:,:,:,,"
    )
    assert (
        endpoint_token(session, 10, "MP", NodeName(2, "/", "talker"), chatter, Qos(depth=7))
        == f"@ros2_lv/2/{session}/0/10/MP/%/%/talker/%chatter/{of_type}/::,7:,:,:,,"
    )


def test_quality_of_service_says_what_differs_from_rmw_zenohs_defaults():
    assert Qos(depth=42).token_part == "::,:,:,:,,"
    assert Qos(reliable=False, transient_local=True, depth=1).token_part == "2:1:,1:,:,:,,"


def test_relative_names_lie_in_the_nodes_namespace():
    assert NodeName(0, "/robot1", "n").qualified("camera/image_raw") == "/robot1/camera/image_raw"
    assert NodeName(0, "/", "n").qualified("image_raw") == "/image_raw"
    assert NodeName(0, "/robot1", "n").qualified("/image_raw") == "/image_raw"


@pytest.mark.parametrize("image", ["/camera/image_raw", "/camera/image_raw/compressed"])
def test_the_lens_is_looked_for_beside_the_pictures(image):
    assert camera_info_beside(image) == "/camera/camera_info"
    assert camera_info_beside("/image_raw") == "/camera_info"


def test_who_publishes_a_topic_is_found_by_its_token_also_with_a_part_more():
    node = NodeName(0, "/front", "driver")
    endpoint = Endpoint("/front/driver", "/camera/image_raw", "sensor_msgs::msg::dds_::Image_", "RIHS01_00")
    token = endpoint_token("ab12", 11, "MP", node, endpoint, Qos())
    expression = KeyExpr(publishers_of(0, "/camera/image_raw"))
    for found in (token, f"{token}/cpu"):  # lyrical appends what its buffers are made of
        assert expression.includes(KeyExpr(found))
        assert read_publisher(found) == endpoint
    other = endpoint_token("ab12", 12, "MS", node, endpoint, Qos())
    assert not expression.intersects(KeyExpr(other))
    assert read_publisher(other) is None


@pytest.mark.parametrize("token", ["", "@ros2_lv", "@ros2_lv/0/ab/0/0/NN/%/%/talker", "a/b/c/d/e/MP/g/h/i/j/k/l/m"])
def test_what_is_no_publishers_token_tells_of_nobody(token):
    assert read_publisher(token) is None


def test_names_that_ros_would_refuse_are_refused():
    assert all(is_topic(name) for name in ("image_raw", "/camera/image_raw", "/_x/y_1"))
    assert not any(is_topic(name) for name in ("", "/", "/1camera", "a//b", "a/", "/a b", "/a/*", "/a\n", "/" + "a" * 300))
    assert node_name("r1.a-b", "camera") == "deixis_r1_a_b_camera"


def test_a_global_id_is_the_hash_that_rmw_zenoh_takes():
    # XXH3-128 of nothing, as xxHash's own tests have it; rmw_zenoh puts the low half first.
    assert global_id("").hex() == bytes.fromhex("99aa06d3014798d86001c324468d497f")[::-1].hex()


# --- attachments ------------------------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(st.integers(0, 2**63 - 1), st.integers(-(2**63), 2**63 - 1), st.binary(min_size=16, max_size=16))
def test_an_attachment_is_what_zenohs_own_serializer_makes(number, source_ns, who):
    attachment = Attachment(number, source_ns, who)
    encoded = attachment.encoded()
    assert len(encoded) == 33
    assert encoded == z_serialize((Int64(number), Int64(source_ns), who)).to_bytes()
    assert Attachment.read(encoded) == attachment


@pytest.mark.parametrize("data", [b"", bytes(32), bytes(34), bytes(33), struct.pack("<qqB16s", 1, 2, 15, bytes(16))])
def test_what_is_no_attachment_is_refused(data):
    with pytest.raises(BadAttachment, match="attachment"):
        Attachment.read(data)


# --- types and bytes --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distribution", ["jazzy", "kilted", "lyrical"])
def test_hashes_of_types_are_the_published_ones(distribution):
    types = RosTypes(distribution)
    assert {name: types.hash_of(name) for name in PUBLISHED} == PUBLISHED


def test_humble_has_no_hashes():
    assert RosTypes("humble").hash_of("sensor_msgs/msg/Image") == "TypeHashNotSupported"


def test_a_recorded_transform_is_read_and_written_byte_for_byte():
    message = JAZZY.decode(TRANSFORMS, RECORDED_TRANSFORM)
    (transform,) = message.transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("base_link", "radar")
    assert stamp_ns(transform.header) == 1490149580_117017840
    assert transform.transform.translation.x == pytest.approx(3.835)
    assert transform.transform.rotation.w == 1.0
    assert JAZZY.encode(message) == RECORDED_TRANSFORM


@settings(max_examples=40)
@given(st.sampled_from(["rgb8", "bgr8"]), TEXTS, st.integers(0, 2**31 - 1))
def test_an_image_laid_out_by_the_rules_of_cdr_is_read_and_written_so(encoding, frame_id, seconds):
    pixels = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)
    payload = fake_ros.cdr_image(pixels, encoding, seconds * 10**9 + 7, frame_id)
    message = JAZZY.decode("sensor_msgs/msg/Image", payload)
    assert (message.width, message.height, message.step, message.encoding) == (6, 4, 18, encoding)
    assert message.header.frame_id == frame_id
    assert stamp_ns(message.header) == seconds * 10**9 + 7
    assert np.array_equal(message.data.reshape(4, 6, 3), pixels)
    assert JAZZY.encode(message) == payload


def test_a_camera_info_laid_out_by_the_rules_of_cdr_is_read_so():
    k = [560.0, 0, 319.5, 0, 561.0, 239.5, 0, 0, 1]
    payload = fake_ros.cdr_camera_info(640, 480, k, 5, "optical")
    message = JAZZY.decode("sensor_msgs/msg/CameraInfo", payload)
    assert (message.width, message.height, message.distortion_model) == (640, 480, "plumb_bob")
    assert list(message.k) == k
    assert JAZZY.encode(message) == payload


def test_big_endian_bytes_are_read_too():
    payload = b"\0\0\0\0" + struct.pack(">iII", 1, 2, 4) + b"cam\0" + struct.pack(">I", 1) + struct.pack(">I", 3) + b"p0\0"
    message = JAZZY.decode("hri_msgs/msg/IdsList", payload)
    assert (message.header.frame_id, message.ids, stamp_ns(message.header)) == ("cam", ["p0"], 1_000_000_002)


BAD = {
    "empty": lambda good: good[:0],
    "no encapsulation": lambda good: good[4:],
    "XCDR2": lambda good: b"\0\x07\0\0" + good[4:],
    "cut": lambda good: good[:-40],
    "a text of 4 GB": lambda good: good[:12] + b"\xff\xff\xff\xff" + good[16:],
    "a text without its end": lambda good: good[:22] + b"x" + good[23:],
    "no text": lambda good: good[:16] + b"\xff\xfe\xfd" + good[19:],
    "too long": lambda good: good + bytes(64),
}


@pytest.mark.parametrize("how", BAD)
def test_bad_bytes_are_refused_with_a_reason(how):
    good = fake_ros.cdr_image(np.zeros((4, 6, 3), np.uint8), "rgb8", 5)
    with pytest.raises(BadCdr, match=r"\w"):
        JAZZY.decode("sensor_msgs/msg/Image", BAD[how](good))


@settings(max_examples=40)
@given(st.binary(max_size=200), st.sampled_from(["sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo", TRANSFORMS]))
def test_any_bytes_are_read_or_refused(payload, type_name):
    for start in (b"", b"\0\1\0\0", b"\0\0\0\0"):
        with suppress(BadCdr):
            JAZZY.decode(type_name, start + payload)
