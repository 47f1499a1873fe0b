"""Stands for ROS 2 nodes on rmw_zenoh: keys, tokens, attachments and bytes by its documents, and not by code of our bridge.

A session as rmw_zenoh opens it (a peer of the router at the endpoint), and the CDR of the three messages that a test sends.
"""

from __future__ import annotations

import itertools
import json
import struct
import time
from contextlib import contextmanager

import zenoh
from zenoh.ext import CacheConfig, declare_advanced_publisher

IMAGE = "sensor_msgs::msg::dds_::Image_/RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"
CAMERA_INFO = "sensor_msgs::msg::dds_::CameraInfo_/RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"
POSE = (
    "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_/"
    "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e"
)
GLOBAL_ID = bytes(range(16))


def session_config(mode, *, connect=(), listen=()):
    config = zenoh.Config()
    for path, value in {
        "mode": mode,
        "connect/endpoints": list(connect),
        "listen/endpoints": list(listen),
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "timestamping/enabled": {"router": True, "peer": True, "client": True},
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(path, json.dumps(value))
    return config


@contextmanager
def ros_router(endpoint):
    """What rmw_zenohd is: a Zenoh router."""
    with zenoh.open(session_config("router", listen=[endpoint])) as session:
        yield session


class RosPeer:
    """One ROS node, `talker` in domain 0."""

    def __init__(self, session):
        self.session = session
        self.heard = []
        self._zid = str(session.info.zid())
        self._declared = [self._token("0/0/NN/%/%/talker")]
        self._ids = itertools.count(10)

    def _token(self, rest):
        return self.session.liveliness().declare_token(f"@ros2_lv/0/{self._zid}/{rest}")

    def _endpoint_token(self, kind, topic, of_type, qos):
        mangled = topic.replace("/", "%")
        self._declared.append(self._token(f"0/{next(self._ids)}/{kind}/%/%/talker/{mangled}/{of_type}/{qos}"))

    def publisher(self, topic, of_type, *, latched=False):
        """A function that publishes CDR bytes; a latched topic is transient local, with a history of one."""
        self._endpoint_token("MP", topic, of_type, ":1:,1:,:,:,," if latched else "::,10:,:,:,,")
        cache = {"cache": CacheConfig(max_samples=1), "publisher_detection": True} if latched else {}
        publisher = declare_advanced_publisher(self.session, f"0{topic}/{of_type}", **cache)
        numbers = itertools.count(1)
        self._declared.append(publisher)

        def put(cdr):
            publisher.put(cdr, attachment=struct.pack("<qqB", next(numbers), time.time_ns(), 16) + GLOBAL_ID)

        return put

    def listen(self, topic, of_type):
        """Hear a topic: (key, CDR bytes, attachment bytes) in `heard`."""

        def note(sample):
            attachment = sample.attachment.to_bytes() if sample.attachment is not None else b""
            self.heard.append((str(sample.key_expr), sample.payload.to_bytes(), attachment))

        self._endpoint_token("MS", topic, of_type, "::,10:,:,:,,")
        self._declared.append(self.session.declare_subscriber(f"0{topic}/{of_type}", note))

    def graph(self):
        """All tokens of the domain."""
        replies = self.session.liveliness().get("@ros2_lv/0/**", timeout=1.0)
        return sorted(str(reply.ok.key_expr) for reply in replies if reply.ok is not None)


@contextmanager
def ros_peer(endpoint):
    """A node linked to the router, as rmw_zenoh links: a peer that listens on loopback."""
    with zenoh.open(session_config("peer", connect=[endpoint], listen=["tcp/127.0.0.1:0"])) as session:
        yield RosPeer(session)


def cdr_header(stamp_ns, frame_id):
    """Encapsulation and std_msgs/Header, padded to 4 bytes."""
    name = frame_id.encode() + b"\0"
    head = b"\0\1\0\0" + struct.pack("<iII", stamp_ns // 10**9, stamp_ns % 10**9, len(name)) + name
    return head + b"\0" * (-len(head) % 4)


def cdr_image(pixels, encoding, stamp_ns, frame_id="camera"):
    """sensor_msgs/Image of an array (H, W, channels) of bytes."""
    height, width, channels = pixels.shape
    name = encoding.encode() + b"\0"
    body = struct.pack("<III", height, width, len(name)) + name + b"\0"  # is_bigendian
    head = cdr_header(stamp_ns, frame_id) + body
    head += b"\0" * (-len(head) % 4)
    return head + struct.pack("<II", width * channels, pixels.size) + pixels.tobytes()


def cdr_camera_info(width, height, k, stamp_ns, frame_id="camera"):
    """sensor_msgs/CameraInfo of a pinhole with plumb_bob and five zeros."""
    model = b"plumb_bob\0"
    out = cdr_header(stamp_ns, frame_id) + struct.pack("<III", height, width, len(model)) + model

    def doubles(numbers):
        nonlocal out
        out += b"\0" * (-(len(out) - 4) % 8) + struct.pack(f"<{len(numbers)}d", *numbers)

    out += b"\0" * (-len(out) % 4) + struct.pack("<I", 5)
    doubles([0.0] * 5)
    doubles(k)
    doubles([1.0, 0, 0, 0, 1, 0, 0, 0, 1])
    doubles([k[0], 0, k[2], 0, 0, k[4], k[5], 0, 0, 0, 1, 0])
    return out + struct.pack("<IIIIIIB", 0, 0, 0, 0, 0, 0, 0)


def cdr_pose(x, y, quaternion, stamp_ns, frame_id="map"):
    """geometry_msgs/PoseWithCovarianceStamped."""
    out = cdr_header(stamp_ns, frame_id)
    out += b"\0" * (-(len(out) - 4) % 8)
    return out + struct.pack("<7d", x, y, 0.0, *quaternion) + struct.pack("<36d", *[0.0] * 36)
