"""The bridge to ROS 2: pictures of a ROS camera go through the whole chain, and ROS hears whom was pointed at.

ROS is played by `fake_ros`, which has keys, tokens, attachments and CDR from rmw_zenoh's documents; no real ROS 2 node is here.
"""

import json
import struct
import subprocess
import threading
import time
from contextlib import ExitStack

import cv2
import fake_ros
import pytest
import yaml
from deixis_ros2.attachment import Attachment
from deixis_ros2.names import global_id
from deixis_ros2.ros_types import RosTypes, stamp_ns
from deixis_runtime.session import open_client
from running import BIN, CLIP, POINTED_AT, ROOT, SITE, answers, command, free_port, get_one, process, tail, wait_until

TYPES = RosTypes("jazzy")
ANSWER = "deixis_msgs/msg/PointedTarget"
IDS = "hri_msgs/msg/IdsList"
REGION = "hri_msgs/msg/NormalizedRegionOfInterest2D"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
HEARD = {
    "/deixis/pointed_target": ANSWER,
    "/humans/faces/tracked": IDS,
    "/humans/bodies/tracked": IDS,
    "/humans/faces/p0/roi": REGION,
    "/humans/bodies/p0/roi": REGION,
    "/tf": TRANSFORMS,
}
PATIENCE_S = 120.0
LONGEST_ANSWER_S = 0.5
UNDER_WAY = 3


def wire_name(type_name):
    package, _, name = type_name.split("/")
    return f"{package}::msg::dds_::{name}_/{TYPES.hash_of(type_name)}"


class Clip(threading.Thread):
    """The example clip as sensor_msgs/Image, again and again, as a ROS camera driver of 15 Hz would send it.

    At that rate, or on a busy machine as quickly as the chain answers: what is dropped there is not what is tested here.
    """

    def __init__(self, put):
        super().__init__(daemon=True)
        self._put = put
        self._stopped = threading.Event()
        self._unanswered = 0
        self._answer = threading.Condition()
        capture = cv2.VideoCapture(str(CLIP))
        self._period_s = 2 / capture.get(cv2.CAP_PROP_FPS)
        pictures = []
        while (read := capture.read())[0]:
            pictures.append(cv2.cvtColor(read[1], cv2.COLOR_BGR2RGB))
        self._pictures = pictures[::2]

    def run(self):
        due_s = time.monotonic()
        while True:
            for picture in self._pictures:
                due_s = max(due_s + self._period_s, time.monotonic())
                if self._stopped.wait(due_s - time.monotonic()):
                    return
                self._wait_for_answers()
                self._put(fake_ros.cdr_image(picture, "rgb8", time.time_ns()))

    def _wait_for_answers(self):
        with self._answer:
            if not self._answer.wait_for(lambda: self._unanswered < UNDER_WAY, LONGEST_ANSWER_S):
                self._unanswered = 0
            self._unanswered += 1

    def answered(self, _sample):
        with self._answer:
            self._unanswered = max(0, self._unanswered - 1)
            self._answer.notify()

    def stop(self):
        self._stopped.set()
        self.join()


class Ros:
    """What the test knows of ROS while it runs."""

    def __init__(self, peer, session, robot, folder):
        self.peer = peer
        self.session = session
        self.robot = robot
        self.folder = folder

    def messages(self, topic):
        """Heard on a topic: (message, attachment)."""
        of_topic = [(cdr, attached) for key, cdr, attached in list(self.peer.heard) if key.startswith(f"0{topic}/")]
        return [(TYPES.decode(HEARD[topic], cdr), Attachment.read(attached)) for cdr, attached in of_topic]

    def wait(self, condition, what):
        return wait_until(condition, what, PATIENCE_S, self.folder / "log")


@pytest.fixture(scope="module")
def ros(tmp_path_factory):
    """All of Deixis but its camera, both halves of the bridge, and ROS's router with a camera node."""
    folder, robot = tmp_path_factory.mktemp("ros2"), "ros2-test"
    router, endpoint = (f"tcp/127.0.0.1:{free_port()}" for _ in range(2))
    site = ("--robot", robot, "--site", SITE)
    bridge = (*site, "--connect", endpoint, "--set", f"ros.router={router}", "--set", "ros.domain=0")
    with ExitStack() as stack:
        enter = stack.enter_context
        log = folder / "log"
        enter(fake_ros.ros_router(router))
        registry = folder / "pois.sqlite"
        enter(process(command("deixis", "up", *site, "--except", "camera", "--listen", endpoint, "--registry", registry), log))
        wait_until(lambda: answers(endpoint), "a router", PATIENCE_S, log)
        enter(process(command("deixis-ros2-camera", *bridge), log))
        enter(process(command("deixis-ros2", *bridge, "--set", "pose=/amcl_pose"), log))
        peer = enter(fake_ros.ros_peer(router))
        for topic, type_name in HEARD.items():
            peer.listen(topic, wire_name(type_name))
        intrinsics = yaml.safe_load((ROOT / "examples" / "pointing_camera.yaml").read_text())
        size = intrinsics["image_width"], intrinsics["image_height"]
        latched = peer.publisher("/camera/camera_info", fake_ros.CAMERA_INFO, latched=True)
        latched(fake_ros.cdr_camera_info(*size, intrinsics["camera_matrix"]["data"], time.time_ns()))
        clip = Clip(peer.publisher("/camera/image_raw", fake_ros.IMAGE))
        session = enter(open_client(endpoint, shared_memory=False))
        wait_until(lambda: get_one(session, f"deixis/{robot}/fusion/state"), "fusion answers", PATIENCE_S, log)
        enter(session.declare_subscriber(f"deixis/{robot}/fusion/belief", clip.answered))
        clip.start()
        stack.callback(clip.stop)
        # Beside the chain, so that it costs no time: the bridge's camera alone, fed by the same driver.
        start = f"{BIN}/deixis-ros2-camera --robot {{robot}} --connect {{connect}} --set ros.router={router} --set ros.domain=0"
        check = subprocess.Popen(
            command("deixis", "check-stage", "camera", "--command", start, "--json"),
            stdout=subprocess.PIPE,
            stderr=log.open("ab"),
        )
        stack.callback(check.wait)
        found = Ros(peer, session, robot, folder)
        found.check = check
        yield found


def test_ros_hears_what_was_pointed_at(ros):
    def named():
        final = [found for found in ros.messages("/deixis/pointed_target") if found[0].is_final]
        return next((found for found in final if POINTED_AT in found[0].poi_ids), None)

    message, attachment = ros.wait(named, f"a final answer on ROS that names {POINTED_AT}")
    assert message.person_id == "p0"
    assert message.header.frame_id == "map"
    assert 0 <= time.time_ns() - stamp_ns(message.header) < PATIENCE_S * 1e9
    assert attachment.number >= 1
    (token,) = [token for token in ros.peer.graph() if "/MP/" in token and "%deixis%pointed_target/" in token]
    assert attachment.global_id == global_id(token), "by this ROS knows which publisher of its graph sent it"


def test_ros_sees_the_bridges_nodes_in_its_graph(ros):
    own = [token for token in ros.peer.graph() if "/deixis_ros2_test_" in token]
    ends = {tuple(token.split("/")[5:10:4]) for token in own}
    assert {("NN",), ("MS", "%camera%image_raw"), ("MS", "%camera%camera_info"), ("MP", "%deixis%pointed_target")} <= ends
    assert ("MS", "%amcl_pose") in ends


def test_faces_and_bodies_are_those_of_ros4hri(ros):
    def seen():
        return all(ros.messages(topic) for topic in HEARD)

    ros.wait(seen, "people on ROS")
    for kind in ("faces", "bodies"):
        assert any("p0" in message.ids for message, _ in ros.messages(f"/humans/{kind}/tracked"))
        box, _ = ros.messages(f"/humans/{kind}/p0/roi")[-1]
        assert 0 <= box.xmin < box.xmax <= 1
        assert 0 <= box.ymin < box.ymax <= 1
    transforms, _ = ros.messages("/tf")[-1]
    assert {item.child_frame_id for item in transforms.transforms} == {"face_p0", "gaze_p0"}
    # The clip's person stands about 1.9 m away.
    assert transforms.transforms[0].transform.translation.z == pytest.approx(1.9, abs=0.4)


def test_the_lens_of_a_latched_camera_info_is_the_cameras(ros):
    info = get_one(ros.session, f"deixis/{ros.robot}/camera/info")
    assert info["state"] == "streaming", info["reason"]
    assert info["intrinsics"] == "K of /camera/camera_info"
    assert info["camera_matrix"][0] == pytest.approx(560.0)


def test_the_robots_pose_comes_from_ros(ros):
    poses = []
    listener = ros.session.declare_subscriber(f"deixis/{ros.robot}/robot/pose", poses.append)
    put = ros.peer.publisher("/amcl_pose", fake_ros.POSE)

    def heard():
        put(fake_ros.cdr_pose(0.0, 0.0, (0.0, 0.0, 0.0, 1.0), time.time_ns()))
        return poses

    ros.wait(heard, "robot/pose")
    listener.undeclare()
    assert str(poses[0].encoding) == "application/msgpack;RobotPose/1"


def test_its_camera_keeps_the_contract(ros):
    out, _ = ros.check.communicate(timeout=120)
    wrong = [item for item in json.loads(out)["checks"] if item["outcome"] != "passed"]
    assert (ros.check.returncode, wrong) == (0, []), tail(ros.folder / "log")


def test_a_broken_picture_is_counted_and_the_next_one_goes_through(ros):
    put = ros.peer.publisher("/camera/image_raw", fake_ros.IMAGE)
    put(struct.pack("<4sII", b"\0\1\0\0", 1, 2) + b"\xff" * 60)

    def refused():
        return (get_one(ros.session, f"deixis/{ros.robot}/camera/health") or {})["counters"].get("pictures_refused")

    assert ros.wait(refused, "a refused picture in health") >= 1

    def last_seq():
        return get_one(ros.session, f"deixis/{ros.robot}/camera/info")["last_seq"]

    before = last_seq()
    ros.wait(lambda: last_seq() > before, "more frames")
