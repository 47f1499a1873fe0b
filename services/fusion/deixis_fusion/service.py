"""The fusion stage: tracks, poses and gestures in; a belief for each frame, targets, and the registry of POIs out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from deixis_runtime.occupancy_map import wall_lines
from deixis_runtime.queries import Query
from deixis_runtime.settings import ConfigError
from deixis_runtime.site import SiteError
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import MAX_TEXT, CameraInfo, FrameId, Message, Poi, SourceState, Target

from .config import FusionConfig
from .fusion import Fusion
from .joining import STAGES, FrameJoiner, JoinedFrame
from .localisation import RobotPlace
from .poi_edits import PoiEdits
from .registry import Registry, RegistryError, default_path
from .registry_recovery import open_registry_file
from .sources import Reading, SourceEnd, SourceMonitor
from .state import Asked, Standing, state_of

DEPTH = 32
# Made in one transaction, between two frames.
EDITS_AT_ONCE = 256
IDLE_S = 0.25
# Stages start one after the other; until then a silent one is no fault.
START_S = 5.0
COPY_EVERY_S = 60.0


class FusionService:
    """Wires the cores to the keys."""

    def __init__(self, node: Node, config: FusionConfig, registry: Registry) -> None:
        self._node = node
        self._registry = registry
        self._rows = config.answer.rows
        self._fusion = Fusion(config, node.producer)
        self._joiner = FrameJoiner(config.joining.lockstep_age_limit_s if node.lockstep else config.joining.age_limit_s)
        self._monitor = SourceMonitor((*STAGES, topics.FRAME.stage), config.joining.dead_after_s)
        self._end = SourceEnd(config.joining.source_silent_s)
        self._edits = PoiEdits(registry, topics.POI.key(node.robot, id=""), self._announce)
        self._started_s = node.monotonic_s()
        self._last = FrameId(0, -1)
        self._counted: dict[str, int] = {}

        self._parts = [node.subscribe(topic, depth=DEPTH) for topic in (topics.TRACKS, topics.HEAD_POSES, topics.GESTURES)]
        self._camera = node.subscribe(topics.CAMERA_INFO, depth=4)
        self._robot = node.subscribe(topics.ROBOT_POSE, depth=DEPTH)
        self._poi_edits = node.subscribe_edits(topics.POI.key(node.robot, id="**"))
        self._camera_clock = None if node.lockstep else node.follow_clock(topics.FRAME.stage)
        self._belief = node.publish(topics.BELIEF)
        self._target = node.publish(topics.TARGET)
        # Keys that name no single POI, too: an edit there is refused in words, not met with silence.
        node.serve_get(topics.POI, self._answer_poi, id="**")
        node.serve_get(topics.STATE, self._answer_state)
        self._place_robot()
        self._pois_changed = True
        self._copy_due_s = 0.0

    def wait_s(self) -> float:
        """How long nothing needs to be done without input."""
        due_s = self._joiner.next_due_s()
        return IDLE_S if due_s is None else min(IDLE_S, max(0.0, due_s - self._node.monotonic_s()))

    def step(self) -> None:
        """Take in what has arrived, and answer what is due."""
        now_s = self._node.monotonic_s()
        self._take_edits()
        self._take_places(now_s)
        self._take_parts(now_s)
        self._monitor.update(self._readings(), now_s)
        for frame in self._joiner.due(now_s, self._monitor.dead()):
            self._answer_frame(frame, now_s)
        camera_waits = self._node.lockstep and topics.FRAME.stage in self._node.alive_stages()
        if self._end.is_over(now_s, camera_waits):
            self._publish(self._fusion.end(self._now_ns()))
        if now_s >= self._copy_due_s:
            self._copy_due_s = now_s + COPY_EVERY_S
            self.keep_copy()
        self._report_sources(now_s)

    def keep_copy(self) -> None:
        """Keep a copy of the registry, where it has changed: for the day that the file is damaged."""
        try:
            self._registry.keep_copy()
        except RegistryError as error:
            self._node.warn("registry copy", str(error))
            self._node.note("registry copy", str(error))
        else:
            self._node.note("registry copy", None)

    # --- inputs -------------------------------------------------------------------------------------------------------

    def _take_parts(self, now_s: float) -> None:
        # Tracks last: they begin a run, and what the others still said of the last one would come too late.
        for subscription in reversed(self._parts):
            for part in subscription.take_all():
                self._joiner.add(part, now_s)
        self._count_to("parts_dropped", self._joiner.dropped)

    def _take_edits(self) -> None:
        edits = self._poi_edits.take(EDITS_AT_ONCE)
        if edits:
            refused = self._edits.take(edits, self._node.now_ns())
            if refused:
                self._node.warn("edit", f"{len(refused)} of {len(edits)} POI edits refused, the first {refused[0]}")
            self._after_edits()
        lost = self._poi_edits.lost
        self._count_to("edits_lost", lost)
        self._node.note("edits_lost", f"{lost} POI edits lost: they came faster than they could be kept" if lost else None)

    def _after_edits(self) -> None:
        # Taken over with the next frame: thousands of edits may come before it.
        self._pois_changed = True
        rejected = self._edits.rejected
        self._count_to("edits_rejected", rejected)
        last = self._edits.rejections[-1] if self._edits.rejections else None
        self._node.note("edits", f"{rejected} POI edits refused, the last {last.key}: {last.reason}" if last else None)

    def _count_to(self, name: str, total: int) -> None:
        """Bring a counter of the health record up to what a core has counted."""
        self._node.count(name, total - self._counted.get(name, 0))
        self._counted[name] = total

    def _announce(self, poi_id: str, poi: Poi | None) -> None:
        self._node.announce(topics.POI, poi, id=poi_id)

    def _take_places(self, now_s: float) -> None:
        for info in self._camera.take_all():
            self._hear_camera(info, now_s)
        for pose in self._robot.take_all():
            self._fusion.hear_robot(pose)

    def _hear_camera(self, info: CameraInfo, now_s: float) -> None:
        lacking = self._fusion.set_camera(info)
        self._end.hear(info, now_s)
        if lacking and info.camera_matrix is not None:
            self._node.count("lenses_refused")
            self._node.warn("lens", f"{self._camera.key}: not used: {info.stage}/{info.instance}: {lacking}")
        unplaced = f"persons cannot be placed: {self._camera.key}: {lacking}" if lacking and info.state == "streaming" else None
        self._node.note("intrinsics", unplaced)

    def _place_robot(self) -> None:
        site = self._node.site
        if site is None:
            return
        self._fusion.set_walls(wall_lines(site))
        pose = site.robot_pose
        self._fusion.start_robot_at(RobotPlace(pose.x_m, pose.y_m, pose.yaw_deg))

    def _readings(self) -> list[Reading]:
        alive = self._node.alive_stages()
        pairs: list[tuple[str, Any]] = [*zip(STAGES, self._parts, strict=True), (topics.FRAME.stage, self._camera)]
        return [
            Reading(
                stage=stage,
                key=subscription.key,
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
        """Wall clock of the camera's host, by which frames are stamped, as far as it was compared with ours.

        None in lockstep, where time stands still and two runs have to be equal.
        """
        if self._camera_clock is None:
            return None
        offset = self._camera_clock.offset()
        self._fusion.clock_uncertain_ns = None if offset is None else offset.uncertain_ns
        return self._node.now_ns() + (0 if offset is None else offset.correction_ns)

    def _answer_frame(self, frame: JoinedFrame, now_s: float) -> None:
        if self._pois_changed:
            self._fusion.set_pois(self._registry.pois())
            self._pois_changed = False
        with self._node.step():
            statuses = {stage: self._monitor.status(stage, missed=True) for stage in frame.missing}
            belief, targets = self._fusion.answer(frame, statuses, self._now_ns())
            # Targets first: in lockstep the belief lets the next frame go.
            self._publish(targets)
            self._belief.put(belief)
        self._last = belief.frame_id
        self._end.answered(belief.frame_id, now_s)
        self._node.count("frames_answered")
        for stage in frame.missing:
            self._node.count(f"missing_{stage}")

    def _publish(self, targets: list[Target]) -> None:
        for target in targets:
            self._target.put(target)
            if target.final:
                self._node.count("episodes")
                self._node.log.info("%s: %s", ", ".join(target.poi_ids[:8]) or "no answer", target.reason)

    def _answer_poi(self, query: Query) -> list[tuple[str, Message]]:
        self._take_edits()
        try:
            return self._edits.answer(query, self._node.now_ns())
        finally:
            self._after_edits()

    def _answer_state(self, query: Query) -> list[tuple[str, Message]]:
        self._take_edits()
        asked = Asked.by(query.parameters, self._registry, self._rows)
        self._monitor.update(self._readings(), self._node.monotonic_s())
        sources = self._monitor.states() + self._robot_source()
        standing = Standing(
            self._node.producer, self._node.robot, self._node.now_ns(), self._last, sources, self._poi_edits.lost
        )
        return [(topics.STATE.key(self._node.robot), state_of(asked, standing, self._fusion, self._registry, self._edits))]

    def _robot_source(self) -> list[SourceState]:
        """The robot, where it says where it is."""
        if self._fusion.robot.newest is None:
            return []
        doubt = self._fusion.robot_doubt
        return [
            SourceState(
                stage="robot",
                status="late" if doubt else "ok",
                producers=self._robot.producers(),
                age_s=self._robot.age_s(),
                received=self._robot.received,
                rejected=self._robot.rejected,
                reason=doubt,
            )
        ]

    def _report_sources(self, now_s: float) -> None:
        for text in (doubled := self._monitor.doubled()):
            self._node.warn("producers", text)
        self._node.note("producers", "; ".join(doubled) or None)
        self._node.note("refused", "; ".join(self._monitor.refused()) or None)
        self._node.note("robot", self._robot_note())
        standing = {stage: self._monitor.status(stage) for stage in STAGES}
        faults = [f"{stage} is {status}: {why}" for stage, (status, why) in standing.items() if status != "ok"]
        if faults and now_s - self._started_s > START_S:
            self._node.set_state("degraded", "; ".join(faults)[:MAX_TEXT])
        elif not faults:
            self._node.set_state("ok")

    def _robot_note(self) -> str | None:
        if self._fusion.robot.newest is None:
            no_site = self._node.site is None
            return "no site and no robot/pose yet: base_link is taken for the map's origin" if no_site else None
        return f"robot/pose: {self._fusion.robot_doubt}" if self._fusion.robot_doubt else None


def serve(node: Node, config: FusionConfig) -> None:
    """Run the stage until told to stop. Raises ConfigError where registry or map cannot be used."""
    try:
        registry = open_registry(node, config)
    except RegistryError as error:
        raise ConfigError(str(error)) from None
    try:
        service = _service(node, config, registry)
        while node.wait(service.wait_s()):
            service.step()
        service.keep_copy()
    finally:
        registry.close()


def _service(node: Node, config: FusionConfig, registry: Registry) -> FusionService:
    try:
        return FusionService(node, config, registry)
    except SiteError as error:
        raise ConfigError(str(error)) from None


def open_registry(node: Node, config: FusionConfig) -> Registry:
    """The registry by its setting, else of this robot and site, else in memory; with the site's changes applied.

    Raises RegistryError.
    """
    path: Path | None = None
    if config.registry:
        path = Path(config.registry).expanduser()
    elif node.site is not None:
        path = default_path(node.robot, node.site.path)
    else:
        node.note("registry", "no site and no registry file: the POIs last as long as this process")
    registry, recovered = open_registry_file(path) if path is not None else (Registry(None), "")
    if recovered:
        node.warn("registry", recovered)
        node.note("registry", recovered)
    if node.site is not None:
        try:
            touched = registry.apply_site(node.site.pois, node.now_ns())
        except RegistryError:
            registry.close()
            raise
        node.log.info("registry %s: %d POIs, %d changed by the site file", path, len(registry.pois()), len(touched))
    return registry


def main(argv: list[str] | None = None) -> int:
    """Command `deixis-fusion`."""
    return run_stage("fusion", FusionConfig, serve, argv)
