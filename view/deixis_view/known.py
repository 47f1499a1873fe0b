"""What has been said and still holds: the camera, the place, the robot's pose, how the stages fare, the answers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from deixis_runtime.site import WallLine
from deixis_schemas import topics
from deixis_schemas.messages import MAX_POIS, CameraInfo, Health, Message, Poi, RobotPose, State, Target

MAX_STAGES = 16


class Known:
    """Hears messages of no frame. `silent_ns`: when, by the clock of who looks on, each stage was last heard."""

    def __init__(self, pois: Iterable[Poi] = (), walls: Sequence[WallLine] = (), robot: RobotPose | None = None) -> None:
        self.pois = {poi.poi_id: poi for poi in list(pois)[:MAX_POIS]}
        self.walls = list(walls)
        self.robot = robot
        self.camera: CameraInfo | None = None
        self.healths: dict[str, Health] = {}
        self.cpu_percent: dict[str, float] = {}
        self.heard_ns: dict[str, int] = {}
        self.target: Target | None = None

    @property
    def names(self) -> dict[str, str]:
        """Of the POIs, by id."""
        return {poi_id: poi.name for poi_id, poi in self.pois.items()}

    @property
    def lockstep(self) -> bool:
        """Whether stamps are media time, and no delay can be told from them."""
        return self.camera is not None and self.camera.lockstep

    def hear(self, key: str, message: Message | None, now_ns: int) -> bool:
        """Take in a message, or the deletion of a POI; whether it changes what is shown."""
        if isinstance(message, Health):
            return self._hear_health(message, now_ns)
        if isinstance(message, CameraInfo):
            self.camera = message
        elif isinstance(message, RobotPose):
            self.robot = message
        elif isinstance(message, Target):
            self.target = message
        elif isinstance(message, State):
            self.robot = message.robot_pose or self.robot
            for poi in message.pois:
                self._keep(poi)
        elif isinstance(message, Poi):
            self._keep(message)
        elif message is None and topics.topic_of(key) is topics.POI:
            self.pois.pop(key.rsplit("/", 1)[-1], None)
        else:
            return False
        return True

    def _keep(self, poi: Poi) -> None:
        if poi.poi_id in self.pois or len(self.pois) < MAX_POIS:
            self.pois[poi.poi_id] = poi

    def _hear_health(self, health: Health, now_ns: int) -> bool:
        before = self.healths.get(health.stage)
        if before is None and len(self.healths) >= MAX_STAGES:
            return False
        if before is not None and before.instance == health.instance and health.uptime_s > before.uptime_s:
            used_s, passed_s = health.cpu_s - before.cpu_s, health.uptime_s - before.uptime_s
            self.cpu_percent[health.stage] = max(0.0, 100 * used_s / passed_s)
        self.healths[health.stage] = health
        self.heard_ns[health.stage] = now_ns
        return True
