"""A session of pointings, as its messages and labels tell it: what was measured, and what fusion answers to the same again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from deixis_fusion.config import FusionConfig
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_fusion.localisation import RobotPlace
from deixis_runtime.lens import Lens, LensError
from deixis_runtime.occupancy_map import wall_lines
from deixis_runtime.site import Site
from deixis_schemas.messages import (
    CameraInfo,
    CameraMount,
    FrameId,
    Gestures,
    HeadPoses,
    Message,
    Producer,
    RobotPose,
    Target,
    Tracks,
)

from .pointings import Frame, Pointing, pointing_of
from .site_labels import Labelled, Labels
from .told_apart import Try

SELF = Producer("fusion", "calibrate")
AROUND_NS = 1_000_000_000
"""Fusion learns a person's place before a stroke, and ends it after; who walks about in between matters not."""


class SessionError(ValueError):
    """A session that nothing can be told from; the text says why."""


@dataclass
class Heard:
    """The messages of a session, frame by frame in their order."""

    frames: dict[FrameId, JoinedFrame] = field(default_factory=dict)
    robot: list[RobotPose] = field(default_factory=list)
    camera: CameraInfo | None = None

    def hear(self, message: Message | None) -> None:
        """Take in whatever comes; what does not matter is passed over."""
        if isinstance(message, CameraInfo) and message.camera_matrix is not None:
            self.camera = message
        elif isinstance(message, RobotPose):
            self.robot.append(message)
        elif isinstance(message, Tracks | HeadPoses | Gestures):
            before = self.frames.get(message.frame_id, JoinedFrame())
            self.frames[message.frame_id] = _with(before, message)

    def tracked(self) -> list[JoinedFrame]:
        """Frames that the tracker has answered, by their time."""
        return sorted((frame for frame in self.frames.values() if frame.tracks), key=lambda frame: frame.source.stamp_ns)

    @property
    def length_s(self) -> float:
        """From the first frame that the tracker has answered to the last, seconds; 0 without any."""
        frames = self.tracked()
        return (frames[-1].source.stamp_ns - frames[0].source.stamp_ns) / 1e9 if frames else 0.0

    def within(self, label: Labelled) -> list[JoinedFrame]:
        """The frames of one pointing."""
        frames = self.tracked()
        first_ns = frames[0].source.stamp_ns if frames else 0
        return self.between(*(first_ns + round(at_s * 1e9) for at_s in (label.from_s, label.to_s)))

    def between(self, first_ns: int, last_ns: int) -> list[JoinedFrame]:
        """The frames that the tracker has answered, from one time to another, both included."""
        return [frame for frame in self.tracked() if first_ns <= frame.source.stamp_ns <= last_ns]

    def place_at(self, stamp_ns: int, start: RobotPlace) -> RobotPlace:
        """Where the robot was, as last told before; `start` where it has told nothing."""
        told = [pose for pose in self.robot if pose.stamp_ns <= stamp_ns]
        return RobotPlace(told[-1].x_m, told[-1].y_m, told[-1].yaw_deg) if told else start

    @property
    def lens(self) -> Lens:
        """The camera's. Raises SessionError."""
        if self.camera is None:
            raise SessionError("the camera never told its lens (camera/info): is it in the recording, does the camera stream?")
        try:
            return Lens.of(self.camera)
        except LensError as error:
            raise SessionError(f"camera/info: {error}") from None


def start_of(site: Site) -> RobotPlace:
    """Where the site file has the robot."""
    return RobotPlace(site.robot_pose.x_m, site.robot_pose.y_m, site.robot_pose.yaw_deg)


def measured(heard: Heard, labels: Labels, site: Site) -> list[Pointing | None]:
    """What was measured of each labelled pointing, in their order; none where no face was seen. Raises SessionError."""
    lens = heard.lens
    return [_measured(heard, label, lens, site) for label in labels.pointings]


def _measured(heard: Heard, label: Labelled, lens: Lens, site: Site) -> Pointing | None:
    frames = heard.within(label)
    person = pointing_person(frames)
    if person is None:
        return None
    robot = heard.place_at(frames[-1].source.stamp_ns, start_of(site))
    return pointing_of(label.poi_id, label.spot, person, list(_of(person, frames)), lens, robot)


def pointing_person(frames: Sequence[JoinedFrame]) -> int | None:
    """The person seen to point in most of these frames; of none, the one whose face is seen in most; none without any."""
    seen: dict[int, tuple[int, int]] = {}
    for frame in frames:
        faces = {track.person_id for track in frame.tracks.tracks if track.kind == "face"} if frame.tracks else set()
        for person in (person for person in faces if person is not None):
            points = next(_of(person, [frame])).points
            strokes, shown = seen.get(person, (0, 0))
            seen[person] = strokes + points, shown + 1
    return max(seen, key=lambda person: seen[person], default=None)


def answer(heard: Heard, label: Labelled, site: Site, config: FusionConfig, mount: CameraMount) -> Try:
    """What fusion answers to a labelled pointing with this mount and these settings. Raises SessionError."""
    if heard.camera is None:
        raise SessionError("the camera never told its lens (camera/info)")
    frames = heard.within(label)
    if not frames:
        return Try(label.poi_id, None)
    camera = heard.camera.model_copy(update={"mount": mount})
    first_ns, last_ns = frames[0].source.stamp_ns, frames[-1].source.stamp_ns
    targets = _targets(heard.between(first_ns - AROUND_NS, last_ns + AROUND_NS), heard.robot, site, config, camera)
    own = [target for target in targets if target.final and target.started_ns <= last_ns and target.ended_ns >= first_ns]
    longest = max(own, key=lambda target: min(target.ended_ns, last_ns) - max(target.started_ns, first_ns), default=None)
    return Try(label.poi_id, None if longest is None else tuple(longest.poi_ids))


def _targets(
    frames: Sequence[JoinedFrame], robot: Sequence[RobotPose], site: Site, config: FusionConfig, camera: CameraInfo
) -> Iterator[Target]:
    fusion = Fusion(config, SELF)
    fusion.set_pois(site.pois)
    fusion.set_walls(wall_lines(site))
    fusion.start_robot_at(start_of(site))
    fusion.set_camera(camera)
    poses = sorted(robot, key=lambda pose: pose.stamp_ns)
    for frame in frames:
        while poses and poses[0].stamp_ns <= frame.source.stamp_ns:
            fusion.hear_robot(poses.pop(0))
        yield from fusion.answer(frame, {}, None)[1]
    yield from fusion.end(None)


def _of(person: int, frames: Iterable[JoinedFrame]) -> Iterator[Frame]:
    for frame in frames:
        if frame.tracks is None:
            continue
        poses = frame.poses.poses if frame.poses else []
        gestures = frame.gestures.gestures if frame.gestures else []
        yield Frame(
            frame.tracks,
            next((pose for pose in poses if pose.person_id == person), None),
            next((gesture for gesture in gestures if gesture.person_id == person), None),
        )


def _with(frame: JoinedFrame, message: Tracks | HeadPoses | Gestures) -> JoinedFrame:
    if isinstance(message, Tracks):
        return JoinedFrame(message, frame.poses, frame.gestures)
    if isinstance(message, HeadPoses):
        return JoinedFrame(frame.tracks, message, frame.gestures)
    return JoinedFrame(frame.tracks, frame.poses, message)
