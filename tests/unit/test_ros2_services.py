"""Both programs of the bridge to ROS 2, turn by turn, without a session."""

import time
from types import SimpleNamespace

import fake_ros
import numpy as np
import pytest
from deixis_ros2 import camera_service
from deixis_ros2.answer_service import RosAnswerStage
from deixis_ros2.camera_service import RosCameraStage
from deixis_ros2.config import RosAnswerConfig, RosCameraConfig
from deixis_ros2.names import NodeName
from deixis_ros2.ros_node import Arrived
from deixis_ros2.ros_types import RosTypes
from deixis_runtime.settings import ConfigError
from deixis_schemas.messages import CameraInfo, Frame, KindProbabilities, RobotPose, Target, Track, Tracks
from deixis_schemas.samples import SAMPLES
from stub_node import StubNode

TYPES = RosTypes("jazzy")
TARGET = next(message for message in SAMPLES if isinstance(message, Target))
TURN_S = 0.5
PICTURE = np.full((96, 128, 3), 7, np.uint8)
K = [100.0, 0, 64, 0, 100, 48, 0, 0, 1]


class Turns(StubNode):
    """A node whose clock advances with each turn, and on whose ROS side `arrive` puts what comes there."""

    def __init__(self, stage, turns, ros):
        super().__init__(stage, [[item for item in turn if not callable(item)] for turn in turns])
        self._ros_side = iter([[item for item in turn if callable(item)] for turn in turns])
        self._ros = ros
        self._elapsed_s = 0.0
        self.totals = {}
        self.subscribed = []

    def wait(self, _timeout_s=0.0):
        for happen in next(self._ros_side, ()):
            happen(self._ros)
        self._elapsed_s += TURN_S
        return super().wait()

    def subscribe(self, topic, **bounds):
        self.subscribed.append(topic.path)
        return super().subscribe(topic, **bounds)

    def monotonic_s(self):
        return self._elapsed_s

    def now_ns(self):
        return time.time_ns()

    def serve_get(self, topic, answer):
        pass

    def count_to(self, name, total):
        self.totals[name] = total


class Recorder:
    def __init__(self, ros, topic):
        self._ros = ros
        self._topic = topic
        ros.standing.add(topic)

    def put(self, message):
        self._ros.sent.append((self._topic, TYPES.decode(message.__msgtype__, TYPES.encode(message))))

    def close(self):
        self._ros.standing.discard(self._topic)


class Input:
    received = overwritten = oversized = unattached = 0

    def __init__(self, type_name, topic):
        self.type_name = type_name
        self.topic = topic
        self.waiting = None

    def take(self):
        taken, self.waiting = self.waiting, None
        return taken


class Ros:
    """ROS's side: what was sent to it by topic, which publishers stand, and what comes from it."""

    name = NodeName(0, "/", "n")
    problem = "ROS is gone"

    def __init__(self):
        self.linked = True
        self.sent = []
        self.standing = set()
        self.inputs = {}

    def start(self):
        pass

    def stop(self):
        pass

    def subscribe(self, type_name, topic, _qos, _max_bytes):
        return self.inputs.setdefault(topic, Input(type_name, topic))

    def publisher(self, _type_name, topic, _qos):
        return Recorder(self, topic)

    def publishers_of(self, _topic):
        return []

    def heard(self, topic):
        return [message for sent, message in self.sent if sent == topic]


def arrive(topic, payload):
    def happen(ros):
        ros.inputs[topic].waiting = Arrived(payload, time.time_ns())

    return happen


def link(linked):
    return lambda ros: setattr(ros, "linked", linked)


def answers(*turns, **settings):
    ros = Ros()
    node = Turns("ros2", turns, ros)
    RosAnswerStage(node, RosAnswerConfig.model_validate({"ros": {"domain": 0}, **settings}), ros, TYPES).run()
    return ros, node


def camera(*turns, **settings):
    ros = Ros()
    node = Turns("camera", turns, ros)
    RosCameraStage(node, RosCameraConfig.model_validate({"ros": {"domain": 0}, **settings}), ros, TYPES).run()
    return [message for message in node.published if isinstance(message, Frame)], node


def seen(seq, *persons):
    faces = [
        Track(
            track_id=person, person_id=person, kind="face", kind_probabilities=KindProbabilities(), centroid_px=(320, 240),
            bbox_px=(300, 200, 40, 60), velocity_px_s=(0, 0),
        )
        for person in persons
    ]  # fmt: skip
    return Tracks(run=1, seq=seq, stamp_ns=seq, stage="tracker", instance="t", width=640, height=480, tracks=faces)


def picture(topic="/camera/image_raw", ago_ms=0, encoding="rgb8"):
    def happen(ros):
        arrive(topic, fake_ros.cdr_image(PICTURE, encoding, time.time_ns() - ago_ms * 10**6))(ros)

    return happen


# --- answers and people -----------------------------------------------------------------------------------------------


def test_an_answer_is_sent_and_one_that_nobody_can_hear_is_counted_and_said():
    ros, node = answers([TARGET], [link(False), TARGET])
    assert [message.episode_id for message in ros.heard("/deixis/pointed_target")] == [TARGET.episode_id]
    assert node.counters["targets_sent"] == node.counters["targets_lost"] == 1
    assert node.warnings == ["targets: not sent, ROS is gone"]
    assert [state for state, _ in node.states] == ["ok", "degraded"]


def test_who_leaves_has_no_topic_any_more_and_nobody_stands_for_ever_where_the_tracker_is_gone():
    ros, _ = answers([seen(0, 1, 2)], [seen(1, 2)], [], [], [], [])
    assert [message.ids for message in ros.heard("/humans/faces/tracked")] == [["p1", "p2"], ["p2"], []]
    assert [len(ros.heard(f"/humans/bodies/{name}/roi")) for name in ("p1", "p2")] == [1, 2]
    assert ros.standing == {"/deixis/pointed_target", "/humans/faces/tracked", "/humans/bodies/tracked"}


def test_where_people_are_kept_from_ros_answers_alone_go_there():
    ros, node = answers([TARGET], [], people=False)
    assert node.subscribed == ["fusion/target"], "what is not asked for cannot go further"
    assert {topic for topic, _ in ros.sent} == ros.standing == {"/deixis/pointed_target"}


def test_the_robots_pose_is_told_and_one_of_another_frame_is_refused():
    good = fake_ros.cdr_pose(1.0, 2.0, (0.0, 0.0, 0.0, 1.0), time.time_ns())
    bad = fake_ros.cdr_pose(1.0, 2.0, (0.0, 0.0, 0.0, 1.0), time.time_ns(), frame_id="odom")
    _, node = answers(
        [arrive("/amcl_pose", good)], [arrive("/amcl_pose", bad)], [arrive("/amcl_pose", b"x")], pose="/amcl_pose"
    )
    (pose,) = [message for message in node.published if isinstance(message, RobotPose)]
    assert (pose.x_m, pose.y_m, pose.yaw_deg, pose.stage) == (1.0, 2.0, 0.0, "ros2")
    assert node.counters["poses_refused"] == 2
    assert "'odom' is not 'map'" in node.warnings[0]


# --- the camera -------------------------------------------------------------------------------------------------------


def test_pictures_are_numbered_and_seen_through_the_lens_that_ros_tells():
    told = fake_ros.cdr_camera_info(128, 96, K, time.time_ns())
    frames, node = camera([picture()], [arrive("/camera/camera_info", told), picture()])
    assert [(frame.seq, frame.encoding, frame.width) for frame in frames] == [(0, "bgr8", 128), (1, "bgr8", 128)]
    infos = [message for message in node.published if isinstance(message, CameraInfo)]
    assert [info.intrinsics[:7] for info in infos if info.state == "streaming"] == ["assumed", "K of /c"]
    assert infos[-1].camera_matrix == tuple(K)


def test_stamps_that_go_back_begin_another_run():
    frames, _ = camera([picture(ago_ms=100)], [picture(ago_ms=10)], [picture(ago_ms=4000)])
    assert [frame.seq for frame in frames] == [0, 1, 0]
    assert frames[0].run == frames[1].run != frames[2].run


def test_what_is_refused_is_counted_named_and_in_the_end_the_cameras_state():
    depth = picture(encoding="32FC1")
    frames, node = camera([arrive("/camera/image_raw", b"\0\1\0\0x")], *[[depth]] * 8)
    assert frames == []
    assert node.counters["pictures_refused"] == 9
    assert "/camera/image_raw: Could not deserialize" in node.warnings[0]
    assert node.states[-1][0] == "degraded"
    assert "encoding '32FC1' is none of" in node.states[-1][1]


def test_a_lens_of_another_shape_is_not_used():
    other = fake_ros.cdr_camera_info(640, 360, [500.0, 0, 320, 0, 500, 180, 0, 0, 1], time.time_ns())
    _, node = camera([arrive("/camera/camera_info", other), picture()])
    assert "640 x 360, pictures have 128 x 96" in node.warnings[0]
    assert node.published[-1].width == 128
    assert "assumed" in node.notes[0]["intrinsics"]


def test_silence_is_said_with_its_reason():
    _, node = camera([picture()], *[[]] * 8)
    assert node.states[0] == ("ok", "")
    assert node.states[-1][0] == "degraded"
    assert "no ROS node publishes /camera/image_raw" in node.states[-1][1]


def test_a_rate_that_is_set_is_kept_to():
    frames, _ = camera(*[[picture()]] * 8, rate_hz=1.0)
    assert len(frames) == 4


def test_pictures_that_come_when_they_come_are_no_matter_for_lockstep():
    with pytest.raises(ConfigError, match="--lockstep"):
        camera_service.serve(SimpleNamespace(lockstep=True), RosCameraConfig())
