"""One head through time by the paper's own method (section 5.2 of Pateraki et al. 2011): a chain of affine matches.

The face patch of the last frame is matched to this one (`affine.py`), the sphere tells by how much its edges turned
(`sphere.py`), and these differential angles are summed from a frontal start on. What the text leaves open is a choice:

* The sphere's centre is the point that the head turns about, in the neck, and its radius reaches from there to the face. With
  a sphere as large as a head about the head's own centre, turns were read 1.5 times too far.
* mu_x, that centre in the picture, goes with the track's box: a patch alone cannot tell a turn from a step aside.
* A patch that has turned by `RENEWED_DEG` is taken anew about the head's centre, and the sum goes on from there: it would
  shrink to nothing toward the sphere's horizon, arccos(1 / P), some 85 degrees.
* The sum drifts, and nothing in it says by how much. The stated sigma grows with the turn, the way turned and the frames
  matched; where it is larger than that of a face seen from the front, such sightings start the head anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from deixis_runtime.lens import Pinhole
from deixis_schemas.messages import FrontalFace, Point

from .affine import match_patch, refusal, take_template, transform
from .config import HeadposeConfig
from .ellipsoid_head import FARTHEST_DEG, MOVED_ON_S, SAME_PLACE_M, WALKING_M_S
from .head import Array, Surface
from .initialise import Initialiser, frontal_of, frontal_pose
from .neck import LEVER_M
from .patch import Level, pyramid
from .sight import ANYWHERE_DEG, HeadState, Sight, centre_of, side_of
from .sphere import angle_of_edges

HALF_WIDTH, HALF_HEIGHT = 0.7, 0.9
"""Size of a new patch, half widths of the head: the part of the face that is nearly a plane to the camera."""
RENEWED_DEG = 20.0
"""A patch that has turned by so much is taken anew; at 30 the mean error was a third larger."""
CALM_S = 1.0
"""So calmly does the centre of a standing head follow its track, whose box jumps by a tenth of its width when a head turns."""
UPRIGHT_DEG = 90.0
"""No head nods or tilts by more: what is summed up to more is drift."""
START_SIGMA_DEG = 2.0
SIGMA_PER_TURN, SIGMA_PER_WAY, SIGMA_PER_FRAME_DEG = 0.1, 0.05, 0.25
"""Shares of the yaw (the radius is wrong for all of it) and of the way there and back; what a frame adds, as a random walk."""
SIGMA_PER_S_HELD = 60.0
"""Degrees per second that the pose is held without a match: a head may turn meanwhile."""
FRONTAL_SIGMA_DEG = 12.0
"""A face that is seen from the front looks into the camera this exactly: the tracker sees some turned by 25."""


@dataclass(frozen=True)
class Chain:
    """A head as the matches so far have it."""

    offset_px: Point
    """Head's centre less that of the track, at the start."""
    depth_m: float
    """Of the sphere's centre from the camera, at the start."""
    centre_px: Point
    """Head's centre (mu_x, mu_y) in the last frame."""
    patch: Array
    """(6,) of eq. 2, in the last frame."""
    template: list[Array]
    """Grey values of the patch in the frame matched last, per pyramid level."""
    speed: Array
    """(6,) change of the patch beside the head's centre, per second."""
    angles: Array
    """(3,) accumulated longitude, latitude and roll, rad."""
    renewed_at: Array
    """(3,) the angles when the patch was taken."""
    seen_ns: int
    matched_ns: int
    way: float = 0.0
    """Sum of the longitude's changes without their sign, rad."""
    frames: int = 0


class AffineHead:
    """Tracks one head by a chain of affine matches; has the face of `EllipsoidHead`."""

    def __init__(self, config: HeadposeConfig, _surface: Surface) -> None:
        self._config = config
        self._half_width_m, _, along = config.head_semi_axes_m
        self._radius_m = along + LEVER_M
        self._initialiser = Initialiser(config.initial_views)
        self._chain: Chain | None = None

    def update(self, sight: Sight) -> HeadState:
        """The head in the next frame."""
        if self._chain is not None:
            self._chain = self._follow(sight, self._carried(sight, self._chain))
        if self._chain is None or self._sigma_deg(self._chain, sight.now_ns) > FRONTAL_SIGMA_DEG:
            self._chain = self._started(sight) or self._chain
        else:
            self._initialiser = Initialiser(self._config.initial_views)
        return HeadState("initialising") if self._chain is None else self._state(self._chain, sight.now_ns)

    # --- start -----------------------------------------------------------------------------------------------------

    def _started(self, sight: Sight) -> Chain | None:
        """A chain that starts in this frame, where several sightings from the front agree; else none."""
        track = centre_of(sight.face)
        agreed = self._initialiser.update(frontal_of(sight), track, sight.now_ns)
        if agreed is None or self._is_elsewhere(sight, agreed):
            return None
        self._initialiser = Initialiser(self._config.initial_views)
        depth = float(np.linalg.norm(frontal_pose(agreed, sight.camera).position_m)) + LEVER_M
        centre = agreed.centre_px
        patch = self._new_patch(centre, depth, sight.camera)
        return Chain(
            offset_px=(centre[0] - track[0], centre[1] - track[1]),
            depth_m=depth,
            centre_px=centre,
            patch=patch,
            template=take_template(self._levels(sight, centre, depth), patch),
            speed=np.zeros(6),
            angles=np.zeros(3),
            renewed_at=np.zeros(3),
            seen_ns=sight.now_ns,
            matched_ns=sight.now_ns,
        )

    def _is_elsewhere(self, sight: Sight, face: FrontalFace) -> bool:
        """Whether a face is not that of the head just matched: frontal faces are also seen in walls beside a profile."""
        chain = self._chain
        if chain is None or (sight.now_ns - chain.matched_ns) * 1e-9 > MOVED_ON_S:
            return False
        return math.dist(face.centre_px, chain.centre_px) * chain.depth_m / sight.camera.focal_px > SAME_PLACE_M

    # --- matching --------------------------------------------------------------------------------------------------

    def _carried(self, sight: Sight, chain: Chain) -> Chain:
        """The chain with centre and patch moved along with the track to this frame: at once in a walk, else calmly."""
        walks = math.hypot(*sight.face.velocity_px_s) * chain.depth_m / sight.camera.focal_px > WALKING_M_S
        pull = 1.0 if walks else 1 - math.exp(-(sight.now_ns - chain.seen_ns) * 1e-9 / CALM_S)
        (track_x, track_y), (x, y) = centre_of(sight.face), chain.centre_px
        across, down = pull * (track_x + chain.offset_px[0] - x), pull * (track_y + chain.offset_px[1] - y)
        patch = chain.patch + np.array([across, 0, 0, down, 0, 0])
        return replace(chain, centre_px=(x + across, y + down), patch=patch, seen_ns=sight.now_ns)

    def _follow(self, sight: Sight, chain: Chain) -> Chain:
        """The chain with the match in this frame added; where it is not accepted, the head is held where it was."""
        dt = max((sight.now_ns - chain.matched_ns) * 1e-9, 1e-3)
        start = chain.patch + chain.speed * dt
        levels = self._levels(sight, chain.centre_px, chain.depth_m)
        match = match_patch(levels, chain.template, start)
        if refusal(match, start, self._config.gate) is not None:
            return replace(chain, speed=np.zeros(6))
        turn = self._angles(match.parameters, chain, sight.camera) - self._angles(chain.patch, chain, sight.camera)
        grown = replace(
            chain,
            patch=match.parameters,
            speed=(match.parameters - chain.patch) / dt,
            angles=chain.angles + turn,
            matched_ns=sight.now_ns,
            way=chain.way + abs(float(turn[0])),
            frames=chain.frames + 1,
        )
        return self._renewed(grown, levels, sight.camera)

    def _renewed(self, chain: Chain, levels: list[Level], camera: Pinhole) -> Chain:
        """The chain with this frame's template; with another patch as well where the last has turned far."""
        if np.abs(chain.angles - chain.renewed_at)[:2].max() > math.radians(RENEWED_DEG):
            chain = replace(chain, patch=self._new_patch(chain.centre_px, chain.depth_m, camera), renewed_at=chain.angles)
        return replace(chain, template=take_template(levels, chain.patch))

    def _new_patch(self, centre_px: Point, depth_m: float, camera: Pinhole) -> Array:
        """An upright patch (6,) about the head's centre."""
        half = self._half_width_px(depth_m, camera)
        return np.array([centre_px[0], HALF_WIDTH * half, 0.0, centre_px[1], 0.0, HALF_HEIGHT * half])

    def _levels(self, sight: Sight, centre_px: Point, depth_m: float) -> list[Level]:
        width = 2 * self._half_width_px(depth_m, sight.camera)
        return pyramid(sight.picture, centre_px, width, self._config.working_width_px, self._config.pyramid_levels)

    def _half_width_px(self, depth_m: float, camera: Pinhole) -> float:
        return camera.focal_px * self._half_width_m / depth_m

    # --- angles ----------------------------------------------------------------------------------------------------

    def _angles(self, patch: Array, chain: Chain, camera: Pinhole) -> Array:
        """Longitude and latitude (eqs 8 and 9) and roll (3,) of a patch from the line head -> camera, rad."""
        distance = chain.depth_m / self._radius_m
        edges = transform(patch, np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]]))
        axis = np.array([camera.centre_x_px, camera.centre_y_px])
        rays = np.arctan((edges - axis) / camera.focal_px) - np.arctan((np.array(chain.centre_px) - axis) / camera.focal_px)
        x = (distance - 1) * np.tan(rays)
        roll = math.atan2(patch[4] - patch[2], patch[1] + patch[5])
        return np.array([angle_of_edges(x[:2, 0], distance), angle_of_edges(x[2:, 1], distance), roll])

    # --- answer ----------------------------------------------------------------------------------------------------

    def _state(self, chain: Chain, now_ns: int) -> HeadState:
        longitude, latitude, roll = (float(angle) for angle in np.degrees(chain.angles))
        sigma_deg = self._sigma_deg(chain, now_ns)
        held = (now_ns - chain.matched_ns) * 1e-9 <= self._config.hold_s
        if not held or sigma_deg > ANYWHERE_DEG or max(abs(latitude), abs(roll)) > UPRIGHT_DEG:
            return HeadState("lost")
        beyond_deg = min(self._config.range_deg, FARTHEST_DEG)
        if abs(longitude) > beyond_deg:
            return HeadState("out_of_range", side=side_of(longitude), beyond_deg=beyond_deg)
        return HeadState("tracking", (longitude, -latitude, roll), sigma_deg)

    def _sigma_deg(self, chain: Chain, now_ns: int) -> float:
        """Standard deviation of the yaw, degrees: a model of the start's error and of what the sum may have drifted by."""
        turn, way = math.degrees(abs(chain.angles[0])), math.degrees(chain.way)
        walk = SIGMA_PER_FRAME_DEG * math.sqrt(chain.frames)
        drift = math.hypot(START_SIGMA_DEG, SIGMA_PER_TURN * turn, SIGMA_PER_WAY * way, walk)
        return drift + SIGMA_PER_S_HELD * (now_ns - chain.matched_ns) * 1e-9
