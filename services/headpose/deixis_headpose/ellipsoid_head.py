"""One head through time by keyframes: start, prediction, matching, the gate, holding and finding it again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from deixis_runtime.lens import Pinhole
from deixis_schemas.messages import Side

from .config import HeadposeConfig
from .head import Array, Pose, Surface, facing_camera, rotation_of
from .initialise import NEAREST_M, Initialiser, frontal_of, frontal_pose
from .keyframes import Keyframes, take_keyframe
from .lsm import Match, correlation, match, observe
from .neck import Neck
from .patch import Level, pyramid
from .sight import ANYWHERE_DEG, HeadState, Sight, centre_of, side_of

SAME_PLACE_M = 0.05
"""Head centres of the same head are this near."""
MOVED_ON_S = 0.3
"""A head not matched for so long may be anywhere near its track."""
WALKING_M_S = 0.4
"""Slower heads stand."""
STILL_TURN, STILL_SHIFT_M = np.radians(1.0), 0.002
"""A head expected this near to where it was last is within the reach of the finest level, and matched on it alone."""
FARTHEST_DEG = 100.0
"""Beyond this yaw too little of the texture is seen to say where the head looks."""
HAND_NEAR = (0.39, 0.33)
"""Keyframes are taken while hands are farther than this from the face's box, across and down, face widths."""
SEARCH_TURNS_DEG = (-36.0, -24.0, -12.0, 12.0, 24.0, 36.0)
"""Turns tried about the vertical where the predicted pose does not match."""


class EllipsoidHead:
    """Tracks one head."""

    def __init__(self, config: HeadposeConfig, surface: Surface) -> None:
        self._config = config
        self._surface = surface
        self._initialiser = Initialiser(config.initial_views)
        self._keyframes = Keyframes(config.keyframe_spacing_deg, config.keyframe_limit)
        self._pose: Pose | None = None
        self._correlation = 0.0
        self._neck: Neck | None = None
        self._velocity: Array = np.zeros(6)
        self._matched_ns = 0
        self._gone: Side | None = None

    def update(self, sight: Sight) -> HeadState:
        """The head in the next frame."""
        if self._pose is None or self._neck is None:
            return self._initialise(sight)
        dt = (sight.now_ns - self._matched_ns) * 1e-9
        found = self._match(sight, self._pose, self._neck, dt)
        if found is not None:
            self._accept(sight, found, self._pose, dt)
        state = self._state(held_s=0.0) if found is not None else self._hold(dt)
        return self._contradicted(sight, state) or state

    # --- start -----------------------------------------------------------------------------------------------------

    def _initialise(self, sight: Sight) -> HeadState:
        agreed = self._initialiser.update(frontal_of(sight), centre_of(sight.face), sight.now_ns)
        if agreed is None:
            return HeadState("initialising")
        pose = frontal_pose(agreed, sight.camera)
        unseen_s = (sight.now_ns - self._matched_ns) * 1e-9
        if self._pose is not None and unseen_s < MOVED_ON_S and not _same_place(pose, self._pose):
            return HeadState("initialising")
        levels = self._levels(sight, pose)
        self._keyframes = Keyframes(self._config.keyframe_spacing_deg, self._config.keyframe_limit)
        self._keyframes.add(take_keyframe(levels, self._surface, pose, sight.camera))
        self._gone = None
        self._velocity = np.concatenate([np.zeros(3), self._walking_speed(sight, pose)])
        self._initialiser = Initialiser(self._config.initial_views)
        self._pose, self._correlation, self._matched_ns = pose, 1.0, sight.now_ns
        self._neck = Neck(pose, self._walking_speed(sight, pose))
        return self._state(held_s=0.0)

    def _walking_speed(self, sight: Sight, pose: Pose) -> Array:
        """Speed (3,) of the head by its track, m/s: a start in mid-walk, taken for a stand, would be read as a turn.

        Zero for those who stand: the velocity of a young track is noise, and would be read as a turn as well.
        """
        across, down = sight.face.velocity_px_s
        speed = np.asarray(np.array([across, down, 0.0]) * pose.position_m[2] / sight.camera.focal_px, np.float64)
        return speed if np.linalg.norm(speed) > WALKING_M_S else np.zeros(3)

    def _contradicted(self, sight: Sight, state: HeadState) -> HeadState | None:
        """Start anew where the head is thought far away or lost and yet frontal faces are seen; else none."""
        assert self._pose is not None
        if state.status == "tracking" and abs(self._pose.angles_deg()[0]) < self._config.doubt_deg:
            self._initialiser = Initialiser(self._config.initial_views)
            return None
        again = self._initialise(sight)
        return None if again.status == "initialising" else again

    # --- matching --------------------------------------------------------------------------------------------------

    def _match(self, sight: Sight, last: Pose, neck: Neck, dt: float) -> Match | None:
        """Match the keyframes to the frame, from the predicted pose, else by a search; none where the gate stays shut."""
        levels = self._levels(sight, last)
        step = self._velocity * dt
        if np.linalg.norm(step[:3]) < STILL_TURN and np.linalg.norm(step[3:]) < STILL_SHIFT_M:
            found = self._refine(levels[:1], last, sight.camera, neck, dt)
            if found.correlation >= self._config.still_gate:
                return found
        starts = [last, last.moved(step), last.moved(1.6 * step)]
        found = self._refine(levels, self._best_start(levels, starts, sight.camera), sight.camera, neck, dt)
        # Out there the answer is the same for any yaw, so a believed match is enough.
        far = abs(found.pose.angles_deg()[0]) > min(self._config.range_deg, FARTHEST_DEG)
        if found.correlation >= (self._config.gate if far else self._config.search_gate):
            return found
        starts = [turned(pose, turn) for pose in (last, last.moved(step)) for turn in SEARCH_TURNS_DEG]
        other = self._refine(levels, self._best_start(levels, starts, sight.camera), sight.camera, neck, dt)
        best = max(found, other, key=lambda m: m.correlation)
        return best if best.correlation >= self._config.gate else None

    def _best_start(self, levels: Sequence[Level], starts: Sequence[Pose], camera: Pinhole) -> Pose:
        """The start at which the keyframes correlate best on the coarsest level."""
        scores = []
        for start in starts:
            templates = [view.templates[-1] for view in self._keyframes.nearest(start, self._config.templates)]
            scores.append(correlation(observe(levels[-1], self._surface, start, camera), templates))
        return starts[int(np.argmax(scores))]

    def _refine(self, levels: Sequence[Level], start: Pose, camera: Pinhole, neck: Neck, dt: float) -> Match:
        """Match from the coarsest level to the finest, each with the keyframes nearest to the pose so far.

        What ends up too near to the camera for a head is no match.
        """
        found = Match(start, -1.0)
        for k in reversed(range(len(levels))):
            views = self._keyframes.nearest(found.pose, self._config.templates)
            templates = [view.templates[k] for view in views]
            found = match(
                levels[k], self._surface, templates, found.pose, camera, neck.prior(found.pose, dt), self._config.iterations
            )
        return found if found.pose.position_m[2] > NEAREST_M else Match(start, -1.0)

    def _levels(self, sight: Sight, pose: Pose) -> list[Level]:
        x, y, z = pose.position_m
        camera = sight.camera
        centre = (camera.focal_px * x / z + camera.centre_x_px, camera.focal_px * y / z + camera.centre_y_px)
        width = 2 * self._config.head_semi_axes_m[0] * camera.focal_px / z
        return pyramid(sight.picture, centre, width, self._config.working_width_px, self._config.pyramid_levels)

    # --- after the match -------------------------------------------------------------------------------------------

    def _accept(self, sight: Sight, found: Match, last: Pose, dt: float) -> None:
        self._velocity = found.pose.step_from(last) / max(dt, 1e-3)
        if self._neck is not None:
            self._neck.update(found.pose, dt)
        self._pose, self._correlation, self._matched_ns = found.pose, found.correlation, sight.now_ns
        if found.correlation >= self._config.keyframe_gate and not _hand_near(sight) and self._keyframes.wants(found.pose):
            levels = self._levels(sight, found.pose)
            self._keyframes.add(take_keyframe(levels, self._surface, found.pose, sight.camera))

    def _hold(self, dt: float) -> HeadState:
        """Below the gate: hold the pose for a while, then say that it is lost.

        However far it was turned: it may as well have been hidden by a hand, or turned back, and out of range would be read as
        a look at what lies behind.
        """
        assert self._pose is not None
        assert self._neck is not None
        self._velocity = np.zeros(6)
        self._neck.rest()
        return self._state(held_s=dt) if dt <= self._config.hold_s else HeadState("lost")

    def _state(self, held_s: float) -> HeadState:
        assert self._pose is not None
        angles = self._pose.angles_deg()
        sigma_deg = yaw_sigma_deg(angles[0], self._correlation, held_s)
        if sigma_deg > ANYWHERE_DEG:
            return HeadState("lost")
        beyond_deg = min(self._config.range_deg, FARTHEST_DEG)
        if abs(angles[0]) > beyond_deg:
            # The back of a head carries little texture, and its yaw may pass 180: the side is the one it left to.
            self._gone = self._gone or side_of(angles[0])
            return HeadState("out_of_range", side=self._gone, beyond_deg=beyond_deg)
        self._gone = None
        return HeadState("tracking", angles, sigma_deg)


def yaw_sigma_deg(yaw_deg: float, correlation: float, held_s: float) -> float:
    """Standard deviation of the yaw, degrees: a model fitted to measured errors.

    It grows with the turn, as the head's size is not known exactly, and beyond 60 degrees with the number of keyframes that
    the turn was chained over. A weak match adds to it; so does every second that the pose is held without one.
    """
    turn = abs(yaw_deg)
    return 1.2 + 0.05 * turn + 0.15 * max(0.0, turn - 60.0) + 10 * max(0.0, 0.95 - correlation) + 60 * held_s


def turned(pose: Pose, turn_deg: float) -> Pose:
    """The pose with the head turned about its own vertical, toward image right."""
    facing = facing_camera(pose.position_m)
    return replace(pose, rotation=facing @ rotation_of(np.radians(turn_deg), 0.0) @ facing.T @ pose.rotation)


def _same_place(one: Pose, other: Pose) -> bool:
    """Whether two poses can be of one head: frontal faces are also seen in walls beside a profile."""
    scale = other.position_m[2] / one.position_m[2]
    shift = np.linalg.norm(one.position_m[:2] * scale - other.position_m[:2])
    return bool(shift < SAME_PLACE_M and 0.75 < scale < 1.33)


def _hand_near(sight: Sight) -> bool:
    """Whether a hand's box comes near the face's: keyframes must not learn hands."""
    x, y, w, h = sight.face.bbox_px
    across, down = HAND_NEAR[0] * w, HAND_NEAR[1] * w
    boxes = [hand.bbox_px for hand in sight.hands]
    return any(a < x + w + across and x < a + c + across and b < y + h + down and y < b + d + down for a, b, c, d in boxes)
