"""One person as fusion follows them: where they are, and their pointing episodes."""

from __future__ import annotations

from deixis_schemas.messages import CameraInfo, HeadPose, Track, Tracks

from .config import FusionConfig
from .episodes import EpisodeTracker
from .localisation import DistanceFilter, HeadSighting, PersonPlace, RobotPlace, depth_of_face, locate


class Person:
    """State of one person between frames."""

    def __init__(self, person_id: int, config: FusionConfig) -> None:
        self.person_id = person_id
        self.episodes = EpisodeTracker(person_id, config)
        self.place: PersonPlace | None = None
        self.seen_ns = 0
        self.published: Published | None = None
        self._config = config
        self._distance = DistanceFilter(config.distance_time_s)
        self._placed_ns: int | None = None

    def see(self, tracks: Tracks, pose: HeadPose | None, info: CameraInfo | None, robot: RobotPlace) -> None:
        """Take in where the person's face is in this frame; an old place is forgotten when it is not seen for long."""
        face = face_of(tracks, self.person_id)
        if face is not None and info is not None and info.camera_matrix is not None:
            self._place(face, tracks, pose, info, robot)
        elif self._placed_ns is not None and tracks.stamp_ns - self._placed_ns > self._config.hold_position_s * 1e9:
            self.place = None

    def _place(self, face: Track, tracks: Tracks, pose: HeadPose | None, info: CameraInfo, robot: RobotPlace) -> None:
        x, y, width, height = face.bbox_px
        measured = depth_of_face(info, width, tracks.width, self._config.face_width_m)
        elapsed_s = (tracks.stamp_ns - self._placed_ns) / 1e9 if self._placed_ns is not None else 0.0
        depth = self._distance.update(measured, elapsed_s, self._is_frontal(pose))
        # Pixel centres are integers: a box from x to x + width - 1 is centred half a pixel before x + width / 2.
        centre = (x + (width - 1) / 2, y + (height - 1) / 2)
        self.place = locate(
            info, robot, HeadSighting(centre, (tracks.width, tracks.height), depth), self._config.distance_sigma
        )
        self._placed_ns = tracks.stamp_ns

    def _is_frontal(self, pose: HeadPose | None) -> bool:
        if pose is None or pose.status != "tracking":
            return pose is None or pose.status != "out_of_range"
        return abs(pose.yaw_deg or 0.0) < self._config.frontal_yaw_deg


class Published:
    """What was last published of the open episode: to send updates on change only, at a bounded rate."""

    def __init__(self, stamp_ns: int, poi_ids: tuple[str, ...], best: float) -> None:
        self.stamp_ns = stamp_ns
        self.poi_ids = poi_ids
        self.best = best


def face_of(tracks: Tracks, person_id: int) -> Track | None:
    """The person's face in these tracks: of several, the one believed most. None without a box of some width."""
    faces = [t for t in tracks.tracks if t.person_id == person_id and t.kind == "face" and t.bbox_px[2] >= 1]
    return max(faces, key=lambda track: (track.observed, track.confidence), default=None)
