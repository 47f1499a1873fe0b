"""The camera stage whose pictures come from ROS 2: sensor_msgs/Image or CompressedImage, and CameraInfo."""

from __future__ import annotations

import math

import cv2
from deixis_runtime.camera_status import CameraStatus
from deixis_runtime.queries import Query
from deixis_runtime.settings import ConfigError
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import CameraState, Frame, HealthState, Message

from .config import RosCameraConfig
from .intrinsics import LensRefused, RosLens, assumed, of_camera_info
from .names import Qos, camera_info_beside, node_name
from .pictures import PictureRefused, of_compressed, of_image
from .preparation import Prepared, prepare
from .ros_node import Arrived, Newest, RosNode, run_linked
from .ros_sources import why_silent
from .ros_types import BadCdr, RosTypes, stamp_ns
from .stamping import Stamped, Stamping

IMAGE, COMPRESSED, CAMERA_INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo"
INFO_PERIOD_S = 2.0
LONGEST_WAIT_S = 0.5
MAX_CAMERA_INFO_BYTES = 1 << 20
HEALTH: dict[CameraState, HealthState] = {"streaming": "ok", "starting": "ok"}


class RosCameraStage:
    """The loop: the newest picture of ROS becomes the next frame."""

    def __init__(self, node: Node, config: RosCameraConfig, ros: RosNode, types: RosTypes) -> None:
        self._node = node
        self._config = config
        self._ros = ros
        self._types = types
        image = ros.name.qualified(config.image)
        info = config.camera_info or camera_info_beside(image)
        image_type = COMPRESSED if config.compressed else IMAGE
        self._images = ros.subscribe(image_type, image, Qos(reliable=False, depth=1), topics.FRAME.max_bytes)
        self._lenses = ros.subscribe(CAMERA_INFO, info, Qos(transient_local=True, depth=1), MAX_CAMERA_INFO_BYTES)
        self._frames = node.publish(topics.FRAME)
        self._infos = node.publish(topics.CAMERA_INFO)
        self._status = CameraStatus(node.producer, f"ROS 2 topic {image}", config.mount)
        self._stamping = Stamping(config.stamps == "header", config.most_off_s)
        self._lens: RosLens | None = None
        # Live, the time tells this start from others.
        self._run = node.now_ns() // 1_000_000
        self._seq = 0
        self._picture_s = node.monotonic_s()
        self._refused, self._refused_s = "", self._picture_s
        self._next_s = -math.inf
        self._info_due_s = 0.0
        node.serve_get(topics.CAMERA_INFO, self._answer)

    def run(self) -> None:
        """Until shutdown."""
        run_linked(self._ros, self._node, self.step, LONGEST_WAIT_S)

    def step(self) -> None:
        """One turn of the loop."""
        self._take_lens()
        if self._node.monotonic_s() >= self._next_s and (arrived := self._images.take()) is not None:
            with self._node.step():
                self._take_picture(arrived)
        self._watch()
        self._count()
        self._publish_info()

    # --- pictures -----------------------------------------------------------------------------------------------------

    def _take_picture(self, arrived: Arrived) -> None:
        try:
            message = self._types.decode(self._images.type_name, arrived.payload)
        except BadCdr as error:
            self._refuse("cdr", f"{self._images.topic}: {error}")
            return
        try:
            picture = of_compressed(message) if self._config.compressed else of_image(message)
            prepared = prepare(picture, self._config.encoding, self._config.quality, self._config.max_width)
        except PictureRefused as error:
            self._refuse("picture", f"{self._images.topic}: {error}")
            return
        self._publish(prepared, self._stamping.stamp(stamp_ns(message.header), arrived.arrived_ns))

    def _refuse(self, kind: str, text: str) -> None:
        self._refused, self._refused_s = text, self._node.monotonic_s()
        self._node.count("pictures_refused")
        self._node.warn(kind, text)
        self._node.note("refused", text)

    def _publish(self, prepared: Prepared, stamped: Stamped) -> None:
        node, producer = self._node, self._node.producer
        self._note_stamp(stamped)
        if stamped.new_run:
            self._run, self._seq = max(self._run + 1, node.now_ns() // 1_000_000), 0
        frame = Frame(
            run=self._run,
            seq=self._seq,
            stamp_ns=stamped.stamp_ns,
            stage=producer.stage,
            instance=producer.instance,
            width=prepared.width,
            height=prepared.height,
            encoding=prepared.encoding,
            data=prepared.data,
        )
        self._see_through(prepared.width, prepared.height)
        self._become("streaming")
        self._publish_info()  # before the frame where it is news: who reads the frame needs its lens
        self._frames.put(frame)
        node.note("refused", None)
        self._status.published(self._run, self._seq)
        self._seq += 1
        self._picture_s = node.monotonic_s()
        if self._config.rate_hz is not None:
            period_s = 1 / self._config.rate_hz
            due_s = self._next_s if self._picture_s - self._next_s <= period_s else self._picture_s
            self._next_s = due_s + period_s

    def _note_stamp(self, stamped: Stamped) -> None:
        text = f"{self._images.topic}: {stamped.complaint}; the time of arrival is used" if stamped.complaint else None
        self._node.note("stamps", text)
        if text is not None:
            self._node.count("stamps_replaced")
            self._node.warn("stamps", f"{text} (setting stamps: arrival)")

    # --- the lens -----------------------------------------------------------------------------------------------------

    def _take_lens(self) -> None:
        arrived = self._lenses.take()
        if arrived is None:
            return
        try:
            message = self._types.decode(CAMERA_INFO, arrived.payload)
            self._lens = of_camera_info(message, self._config.rectified, self._lenses.topic)
        except (BadCdr, LensRefused) as error:
            text = f"{self._lenses.topic}: {error}"
            self._node.count("lenses_refused")
            self._node.warn("lens", text)
            self._node.note("lens", text)
        else:
            self._node.note("lens", None)

    def _see_through(self, width: int, height: int) -> None:
        lens = self._lens
        if lens is not None and not lens.fits(width, height):
            is_for = f"{lens.width} x {lens.height}"
            self._node.warn("shape", f"{self._lenses.topic} is for {is_for}, pictures have {width} x {height}: it is not used")
            lens = None
        lens = lens or assumed(width, height, self._config.horizontal_fov_deg)
        if self._status.projects(lens.width, lens.height, lens):
            self._node.note("intrinsics", f"intrinsics: {lens.source}")

    # --- what is said of it -------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        if not self._ros.linked:
            if self._ros.problem:
                self._become("retrying", self._ros.problem)
        elif self._node.monotonic_s() - max(self._picture_s, self._refused_s) > self._config.stalled_after_s:
            images = self._images
            publishers, type_hash = self._ros.publishers_of(images.topic), self._types.hash_of(images.type_name)
            self._become("retrying", why_silent(images.topic, images.type_name, type_hash, publishers))
        elif self._refused_s - self._picture_s > self._config.stalled_after_s:
            self._become("retrying", self._refused)

    def _become(self, state: CameraState, reason: str = "") -> None:
        if self._status.become(state, reason):
            health = HEALTH.get(state, "degraded")
            self._node.set_state(health, reason if health != "ok" else "")

    def _count(self) -> None:
        for name, item in (("ros_images", self._images), ("ros_camera_infos", self._lenses)):
            _count_input(self._node, name, item)

    def _publish_info(self) -> None:
        now_s = self._node.monotonic_s()
        if self._status.changed or now_s >= self._info_due_s:
            self._infos.put(self._status.info(self._node.now_ns()))
            self._status.changed = False
            self._info_due_s = now_s + INFO_PERIOD_S

    def _answer(self, _query: Query) -> list[tuple[str, Message]]:
        return [(topics.CAMERA_INFO.key(self._node.robot), self._status.info(self._node.now_ns()))]


def _count_input(node: Node, name: str, item: Newest) -> None:
    node.count_to(f"{name}_received", item.received)
    node.count_to(f"{name}_overwritten", item.overwritten)
    if item.oversized:
        node.count_to(f"{name}_oversized", item.oversized)
        node.warn(f"size {name}", f"{item.topic}: {item.oversized} messages were too large")
    if item.unattached:
        node.count_to(f"{name}_without_attachment", item.unattached)


def serve(node: Node, config: RosCameraConfig) -> None:
    """Run the stage until shutdown."""
    if node.lockstep:
        raise ConfigError("--lockstep: pictures of ROS come when they come; they cannot wait for an answer")
    cv2.setNumThreads(1)  # converting one picture is quick; threads cost the other stages more than they gain here
    types = RosTypes(config.ros.distribution)
    ros = RosNode(config.ros, node_name(node.robot, "camera"), types, node.wake)
    RosCameraStage(node, config, ros, types).run()


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-ros2-camera`."""
    return run_stage("camera", RosCameraConfig, serve, argv, "Pictures of a ROS 2 camera to frames.")
