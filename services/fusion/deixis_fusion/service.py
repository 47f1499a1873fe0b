"""The fusion stage: tracks, poses and gestures in; a belief for each frame, targets, and the registry of POIs out."""

from __future__ import annotations

import tempfile
from collections import deque
from pathlib import Path
from typing import Any

from deixis_runtime.queries import Query
from deixis_runtime.settings import ConfigError
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, FrameId, Message, PersonBelief, RobotPose, State, Target

from .config import FusionConfig
from .fusion import Fusion
from .joining import STAGES, FrameJoiner, JoinedFrame
from .localisation import RobotPlace
from .poi_edits import PoiEdits
from .registry import Registry, RegistryError
from .registry_path import default_registry_path
from .source_end import SourceEnd
from .sources import Reading, SourceMonitor

DEPTH = 32
KEPT_TARGETS = 16
MAX_OPEN = 32
IDLE_S = 0.25
# Stages start one after the other; until then a silent one is no fault.
START_S = 5.0


class FusionService:
    """Wires the cores to the keys."""

    def __init__(self, node: Node, config: FusionConfig, registry: Registry) -> None:
        self._node = node
        self._registry = registry
        self._fusion = Fusion(config, node.producer)
        self._joiner = FrameJoiner(config.lockstep_age_limit_s if node.lockstep else config.age_limit_s)
        self._monitor = SourceMonitor((*STAGES, "camera"), config.dead_after_s)
        self._end = SourceEnd(config.source_silent_s)
        self._edits = PoiEdits(registry, topics.POI.key(node.robot, id=""))
        self._started_s = node.monotonic_s()
        self._robot_pose: RobotPose | None = None
        self._persons: list[PersonBelief] = []
        self._last = FrameId(0, -1)
        self._targets: deque[Target] = deque(maxlen=KEPT_TARGETS)

        self._parts = [node.subscribe(topic, depth=DEPTH) for topic in (topics.TRACKS, topics.HEAD_POSES, topics.GESTURES)]
        self._camera = node.subscribe(topics.CAMERA_INFO, depth=4)
        self._robot = node.subscribe(topics.ROBOT_POSE)
        self._poi_edits = node.subscribe_edits(topics.POI.key(node.robot, id="**"))
        self._belief = node.publish(topics.BELIEF)
        self._target = node.publish(topics.TARGET)
        node.serve_get(topics.POI, self._answer_poi, id="**")
        node.serve_get(topics.STATE, self._answer_state)
        self._place_robot()
        self._fusion.set_pois(registry.pois())

    def wait_s(self) -> float:
        """How long nothing needs to be done without input."""
        due_s = self._joiner.next_due_s()
        return IDLE_S if due_s is None else min(IDLE_S, max(0.0, due_s - self._node.monotonic_s()))

    def step(self) -> None:
        """Take in what has arrived, and answer what is due."""
        now_s = self._node.monotonic_s()
        self._take_edits()
        self._take_places(now_s)
        for subscription in self._parts:
            for part in subscription.take_all():
                if self._joiner.add(part, now_s):
                    self._finish_episodes()
        self._monitor.update(self._readings(), now_s)
        for frame in self._joiner.due(now_s, self._monitor.dead()):
            self._answer_frame(frame, now_s)
        camera_waits = self._node.lockstep and "camera" in self._node.alive_stages()
        if self._end.is_over(now_s, camera_waits):
            self._finish_episodes()
        self._report_sources(now_s)

    # --- inputs -------------------------------------------------------------------------------------------------------

    def _take_edits(self) -> None:
        edits = self._poi_edits.take_all()
        for edit in edits:
            refused = self._edits.take(edit, self._node.now_ns())
            if refused is not None:
                self._node.warn("edit", f"{edit.key}: edit refused: {refused}")
        if edits:
            self._after_edits()

    def _after_edits(self) -> None:
        self._fusion.set_pois(self._registry.pois())
        rejected = self._edits.rejected
        last = self._edits.rejections[-1] if self._edits.rejections else None
        self._node.note("edits", f"{rejected} POI edits refused, the last {last.key}: {last.reason}" if last else None)

    def _take_places(self, now_s: float) -> None:
        for info in self._camera.take_all():
            self._hear_camera(info, now_s)
        pose = self._robot.take()
        if pose is not None:
            self._robot_pose = pose
            self._fusion.set_robot(RobotPlace(pose.x_m, pose.y_m, pose.yaw_deg))
            self._node.note("robot", None)

    def _hear_camera(self, info: CameraInfo, now_s: float) -> None:
        self._fusion.set_camera(info)
        self._end.hear(info, now_s)
        lacking = info.state == "streaming" and info.camera_matrix is None
        self._node.note("intrinsics", "the camera has no intrinsics: persons cannot be placed" if lacking else None)

    def _place_robot(self) -> None:
        site = self._node.site
        if site is None:
            self._node.note("robot", "no site and no robot/pose yet: base_link is taken for the map's origin")
            return
        self._fusion.set_walls(site.walls)
        pose = site.robot_pose
        self._fusion.set_robot(RobotPlace(pose.x_m, pose.y_m, pose.yaw_deg))

    def _readings(self) -> list[Reading]:
        alive = self._node.alive_stages()
        pairs: list[tuple[str, Any]] = [*zip(STAGES, self._parts, strict=True), ("camera", self._camera)]
        return [
            Reading(
                stage=stage,
                alive=stage in alive,
                received=subscription.received,
                rejected=subscription.rejected,
                age_s=subscription.age_s(),
                last_error=subscription.last_error,
                last_error_kind=subscription.last_error_kind,
                producers=tuple(subscription.producers()),
            )
            for stage, subscription in pairs
        ]

    # --- outputs ------------------------------------------------------------------------------------------------------

    def _now_ns(self) -> int | None:
        """Wall clock; none in lockstep, where time stands still and two runs have to be equal."""
        return None if self._node.lockstep else self._node.now_ns()

    def _answer_frame(self, frame: JoinedFrame, now_s: float) -> None:
        with self._node.step():
            statuses = {stage: self._monitor.status(stage, answered=False) for stage in frame.missing}
            belief, targets = self._fusion.answer(frame, statuses, self._now_ns())
            # Targets first: in lockstep the belief lets the next frame go.
            self._publish(targets)
            self._belief.put(belief)
        self._persons, self._last = belief.persons, belief.frame_id
        self._end.answered(belief.frame_id, now_s)
        self._node.count("frames_answered")
        for stage in frame.missing:
            self._node.count(f"missing_{stage}")

    def _finish_episodes(self) -> None:
        self._publish(self._fusion.end(self._now_ns()))
        self._persons = []

    def _publish(self, targets: list[Target]) -> None:
        for target in targets:
            self._target.put(target)
            if target.final:
                self._targets.append(target)
                self._node.count("episodes")
                self._node.log.info("%s: %s", ", ".join(target.poi_ids) or "no answer", target.reason)

    def _answer_poi(self, query: Query) -> list[tuple[str, Message]]:
        self._take_edits()
        try:
            return self._edits.answer(query, self._node.now_ns())
        finally:
            self._after_edits()

    def _answer_state(self, _: Query) -> list[tuple[str, Message]]:
        self._take_edits()
        self._monitor.update(self._readings(), self._node.monotonic_s())
        stage, instance = self._node.producer
        state = State(
            stamp_ns=self._node.now_ns(),
            stage=stage,
            instance=instance,
            robot=self._node.robot,
            sources=self._monitor.states(),
            robot_pose=self._robot_pose,
            pois=self._registry.pois(),
            persons=self._persons,
            pois_total=len(self._registry.pois()),
            run=self._last.run,
            last_seq=self._last.seq,
            open_episodes=self._fusion.open_episodes()[:MAX_OPEN],
            recent_targets=list(self._targets),
            registry_path=str(self._registry.path)[:2000],
            edits_accepted=self._edits.accepted,
            edits_rejected=self._edits.rejected,
            rejected_edits=list(self._edits.rejections),
        )
        return [(topics.STATE.key(self._node.robot), state)]

    def _report_sources(self, now_s: float) -> None:
        for text in (doubled := self._monitor.doubled()):
            self._node.warn("producers", text)
        self._node.note("producers", "; ".join(doubled) or None)
        standing = {stage: self._monitor.status(stage) for stage in STAGES}
        faults = [f"{stage} is {status}: {why}" for stage, (status, why) in standing.items() if status != "ok"]
        if faults and now_s - self._started_s > START_S:
            self._node.set_state("degraded", "; ".join(faults))
        elif not faults:
            self._node.set_state("ok")


def serve(node: Node, config: FusionConfig) -> None:
    """Run the stage until told to stop. Raises ConfigError where the registry cannot be used."""
    with tempfile.TemporaryDirectory(prefix="deixis-fusion-") as scratch:
        try:
            registry = open_registry(node, config, Path(scratch))
        except RegistryError as error:
            raise ConfigError(str(error)) from None
        try:
            service = FusionService(node, config, registry)
            while node.wait(service.wait_s()):
                service.step()
        finally:
            registry.close()


def open_registry(node: Node, config: FusionConfig, scratch: Path) -> Registry:
    """The registry by its setting, else of this robot and site, else a temporary one; with the site's changes applied.

    Raises RegistryError.
    """
    if config.registry:
        path = Path(config.registry).expanduser()
    elif node.site is not None:
        path = default_registry_path(node.robot, node.site.path)
    else:
        path = scratch / "pois.sqlite"
        node.note("registry", "no site and no registry file: the POIs last as long as this process")
    registry = Registry(path)
    if node.site is not None:
        try:
            touched = registry.apply_site(node.site.pois)
        except RegistryError:
            registry.close()
            raise
        node.log.info("registry %s: %d POIs, %d changed by the site file", path, len(registry.pois()), len(touched))
    return registry


def main(argv: list[str] | None = None) -> int:
    """Command `deixis-fusion`."""
    return run_stage("fusion", FusionConfig, serve, argv)
