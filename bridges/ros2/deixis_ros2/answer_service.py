"""The other half of the bridge: answers and people to ROS 2, and the robot's pose from it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from deixis_runtime.camera_lens import CameraLens
from deixis_runtime.mount import Vector
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import HeadPoses, RobotPose, Tracks

from .config import RosAnswerConfig
from .names import Qos, node_name
from .people import Box, Quaternion, head_places, people_of
from .robot_pose import PoseRefused, of_message
from .ros_node import RosNode, RosPublisher, run_linked
from .ros_types import BadCdr, RosTypes, stamp_ns
from .stamping import Stamping
from .targets import POINTED_TARGET, pointed_target

IDS, REGION = "hri_msgs/msg/IdsList", "hri_msgs/msg/NormalizedRegionOfInterest2D"
TRANSFORMS, POSE = "tf2_msgs/msg/TFMessage", "geometry_msgs/msg/PoseWithCovarianceStamped"
MAX_POSE_BYTES = 1 << 16
LONGEST_WAIT_S = 0.25
POSES_KEPT = 8
FORGET_AFTER_S = 2.0
ASSUMED_FOV_DEG = 60.0
RELIABLE = Qos(depth=10)
OF_TRANSFORMS = Qos(depth=100)


class Regions:
    """The boxes of one kind, faces or bodies: each id has a topic of its own, which comes and goes with it."""

    def __init__(self, ros: RosNode, types: RosTypes, kind: str) -> None:
        self._ros = ros
        self._types = types
        self._prefix = f"/humans/{kind}"
        self._tracked: RosPublisher | None = None
        self._of_each: dict[str, RosPublisher] = {}

    def put(self, header: Any, boxes: Mapping[str, Box]) -> None:
        """Publish who is tracked, and where."""
        self._tracked = self._tracked or self._ros.publisher(IDS, f"{self._prefix}/tracked", RELIABLE)
        for name in set(self._of_each) - set(boxes):
            self._of_each.pop(name).close()
        for name in boxes:
            if name not in self._of_each and (made := self._ros.publisher(REGION, f"{self._prefix}/{name}/roi", RELIABLE)):
                self._of_each[name] = made
        if self._tracked is not None:
            self._tracked.put(self._types.make(IDS, header=header, ids=sorted(boxes)))
        for name, publisher in self._of_each.items():
            box = boxes[name]
            publisher.put(
                self._types.make(
                    REGION, header=header, xmin=box.xmin, ymin=box.ymin, xmax=box.xmax, ymax=box.ymax, c=box.confidence
                )
            )


class RosAnswerStage:
    """The loop: what Deixis says is said to ROS."""

    def __init__(self, node: Node, config: RosAnswerConfig, ros: RosNode, types: RosTypes) -> None:
        self._node = node
        self._config = config
        self._ros = ros
        self._types = types
        self._targets = node.subscribe(topics.TARGET, depth=16)
        self._target: RosPublisher | None = None
        self._transforms: RosPublisher | None = None
        self._faces, self._bodies = Regions(ros, types, "faces"), Regions(ros, types, "bodies")
        self._lens = CameraLens(ASSUMED_FOV_DEG)
        self._people_s = 0.0
        self._shown_s: float | None = None
        if config.people:
            self._tracks = node.subscribe(topics.TRACKS)
            self._poses = node.subscribe(topics.HEAD_POSES, depth=POSES_KEPT)
            self._infos = node.subscribe(topics.CAMERA_INFO, depth=4)
        if config.pose is not None:
            self._robot_poses = ros.subscribe(POSE, config.pose, Qos(transient_local=True, depth=1), MAX_POSE_BYTES)
            self._published = node.publish(topics.ROBOT_POSE)
            self._stamping = Stamping(by_header=True, most_off_s=config.most_off_s)

    def run(self) -> None:
        """Until shutdown."""
        run_linked(self._ros, self._node, self.step, LONGEST_WAIT_S)

    def step(self) -> None:
        """One turn of the loop."""
        self._say_link()
        with self._node.step():
            for target in self._targets.take_all():
                self._target = self._target or self._ros.publisher(POINTED_TARGET, self._config.target, RELIABLE)
                self._send(self._target, pointed_target(self._types, target, self._config.map_frame), "targets")
            if self._config.people:
                self._tell_people()
            if self._config.pose is not None:
                self._take_pose()

    def _say_link(self) -> None:
        if self._ros.linked:
            self._node.set_state("ok")
            # Who asks for the topic's publishers before the first answer is to find one.
            self._target = self._target or self._ros.publisher(POINTED_TARGET, self._config.target, RELIABLE)
        elif self._ros.problem:
            self._node.set_state("degraded", self._ros.problem)

    def _send(self, publisher: RosPublisher | None, message: Any, what: str) -> None:
        if publisher is None or not self._ros.linked:
            self._node.count(f"{what}_lost")
            self._node.warn("lost", f"{what}: not sent, {self._ros.problem or 'ROS is not linked yet'}")
            return
        publisher.put(message)
        self._node.count(f"{what}_sent")

    # --- people -------------------------------------------------------------------------------------------------------

    def _tell_people(self) -> None:
        for text in self._lens.hear(self._infos.take_all()):
            self._node.count("lenses_refused")
            self._node.warn("lens", text)
        now_s = self._node.monotonic_s()
        if now_s < self._people_s:
            return
        tracks = self._tracks.take()
        if tracks is None:
            self._forget_people(now_s)
            return
        self._people_s = now_s + 1 / self._config.people_rate_hz
        if not self._ros.linked:
            return
        self._shown_s = now_s
        header = self._types.header(tracks.stamp_ns, self._config.camera_frame)
        people = people_of(tracks)
        self._faces.put(header, people.faces)
        self._bodies.put(header, people.bodies)
        self._node.count("people_sent")
        if self._config.transforms:
            self._tell_heads(tracks)

    def _forget_people(self, now_s: float) -> None:
        """Who was shown is not there for ever because the tracker is gone."""
        if self._shown_s is None or now_s - self._shown_s < FORGET_AFTER_S or not self._ros.linked:
            return
        self._shown_s = None
        header = self._types.header(self._node.now_ns(), self._config.camera_frame)
        self._faces.put(header, {})
        self._bodies.put(header, {})

    def _tell_heads(self, tracks: Tracks) -> None:
        poses: HeadPoses | None = self._poses.take()
        if poses is None or poses.run != tracks.run:
            return
        lens, mount = self._lens.of_frame(tracks.width, tracks.height), self._lens.mount
        places = head_places(tracks, poses.poses, lens, mount)
        if not places:
            return
        header = self._types.header(tracks.stamp_ns, self._config.camera_frame)
        transforms = []
        for name, place in places.items():
            transforms.append(self._transform(header, f"face_{name}", place.position_m, place.face))
            transforms.append(self._transform(header, f"gaze_{name}", place.position_m, place.gaze))
        self._transforms = self._transforms or self._ros.publisher(TRANSFORMS, "/tf", OF_TRANSFORMS)
        self._send(self._transforms, self._types.make(TRANSFORMS, transforms=transforms), "transforms")

    def _transform(self, header: Any, child: str, position_m: Vector, turn: Quaternion) -> Any:
        (along, down, ahead), (x, y, z, w), make = position_m, turn, self._types.make
        transform = make(
            "geometry_msgs/msg/Transform",
            translation=make("geometry_msgs/msg/Vector3", x=along, y=down, z=ahead),
            rotation=make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w),
        )
        return make("geometry_msgs/msg/TransformStamped", header=header, child_frame_id=child, transform=transform)

    # --- the robot's pose ---------------------------------------------------------------------------------------------

    def _take_pose(self) -> None:
        arrived = self._robot_poses.take()
        if arrived is None:
            return
        try:
            message = self._types.decode(POSE, arrived.payload)
            pose = of_message(message, self._config.map_frame)
        except (BadCdr, PoseRefused) as error:
            text = f"{self._robot_poses.topic}: {error}"
            self._node.count("poses_refused")
            self._node.warn("pose", text)
            self._node.note("pose", text)
            return
        stamped = self._stamping.stamp(stamp_ns(message.header), arrived.arrived_ns)
        self._node.note("pose", f"{self._robot_poses.topic}: {stamped.complaint}" if stamped.complaint else None)
        stage, instance = self._node.producer
        self._published.put(RobotPose(stamp_ns=stamped.stamp_ns, stage=stage, instance=instance, **pose._asdict()))


def serve(node: Node, config: RosAnswerConfig) -> None:
    """Run the stage until shutdown."""
    types = RosTypes(config.ros.distribution)
    ros = RosNode(config.ros, node_name(node.robot, "answers"), types, node.wake)
    RosAnswerStage(node, config, ros, types).run()


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-ros2`."""
    return run_stage("ros2", RosAnswerConfig, serve, argv, "Answers and people to ROS 2, the robot's pose from it.")
