"""People who point at known things from known spots before a camera that is mounted 4 degrees off: as measured, and as told by
the stages' messages.
"""

import math

import numpy as np
from deixis_calibration.pointings import ORIGIN, Pointing
from deixis_fusion.localisation import wrapped_deg
from deixis_runtime.mount import to_base
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import (
    CameraInfo,
    CameraMount,
    FrontalFace,
    Gesture,
    Gestures,
    HeadPose,
    HeadPoses,
    KindProbabilities,
    Poi,
    Track,
    Tracks,
)

SPOTS = {"A": (2.0, 0.0), "B": (2.4, 0.7), "C": (1.6, -0.5)}
POIS = {
    name: Poi(poi_id=name, position_m=(*xy, 1.25))
    for name, xy in {
        **{"P1": (3.4, 1.7), "P2": (2.6, 2.4), "P3": (0.95, 1.82), "P4": (0.2, 1.05)},
        **{"P6": (0.2, -1.04), "P7": (0.8, -1.75), "P8": (1.7, -1.9), "P9": (2.6, -2.2)},
    }.items()
}
TRUE = CameraMount(position_m=(0.1, 0.0, 1.3), yaw_deg=4.0, pitch_up_deg=1.0)
BELIEVED = CameraMount(position_m=(0.1, 0.0, 1.3), yaw_deg=0.0, pitch_up_deg=3.0)
HEAD_M, FOCAL = 1.62, 560.0


def optical_of(place, mount):
    """A point in base_link as the camera sees it: the inverse of the mount, column by column."""
    turn = np.array([to_base(axis, mount) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]).T
    return tuple(np.linalg.inv(turn) @ (np.array(place) - mount.position_m))


def bearing_from(spot, poi, camera=TRUE.position_m):
    to_camera = math.atan2(camera[1] - spot[1], camera[0] - spot[0])
    return wrapped_deg(math.degrees(math.atan2(poi[1] - spot[1], poi[0] - spot[0]) - to_camera))


def simulated(rounds=2, seed=0, robot=ORIGIN, standing_m=0.02):
    """Pointings as the stages would measure them, at each POI from each spot."""
    rng = np.random.default_rng(seed)
    for spot in SPOTS:
        for name in list(POIS) * rounds:
            yield pointing(rng, spot, name, robot, standing_m)


def pointing(rng, spot, name, robot=ORIGIN, standing_m=0.02):
    """Of people who sway, whose arms and heads err and turn part of the way."""
    x, y = np.array(SPOTS[spot]) + rng.normal(0, standing_m, 2)
    head = np.array(optical_of((x, y, HEAD_M), TRUE)) * math.exp(rng.normal(0, 0.04))
    bearing = bearing_from((x, y), POIS[name].position_m)
    side = "point_left" if bearing > 0 else "point_right"
    pointed = bearing + rng.normal(0, 8)
    return Pointing(name, spot, tuple(head), side, pointed, 8.0, False, 0.9 * bearing + rng.normal(0, 6), 4.0, robot)


def messages_of(pointing, seq):
    """A frame in which somebody points, as the three stages tell it."""
    of = {"run": 1, "seq": seq, "stamp_ns": 1_000_000_000 + round(seq * 1e9 / 10), "instance": "x"}
    x, y, z = pointing.head_m
    width = FOCAL * FACE_WIDTH_M / z
    at = FOCAL * x / z + 319.5, FOCAL * y / z + 239.5
    face = Track(
        track_id=0,
        person_id=0,
        kind="face",
        kind_probabilities=KindProbabilities(face=1),
        centroid_px=at,
        bbox_px=(at[0] - (width - 1) / 2, at[1] - (width - 1) / 2, width, width),
        velocity_px_s=(0, 0),
        frontal=FrontalFace(centre_px=at, width_px=width),
    )
    yaw = max(-120.0, min(120.0, pointing.yaw_deg))
    head = HeadPose(person_id=0, status="tracking", yaw_deg=yaw, yaw_sigma_deg=4.0, face_width_px=width)
    hand = {"phase": "idle", "gesture": "none"}
    if pointing.gesture is not None:
        bearing = wrapped_deg(pointing.bearing_deg)
        hand = {"phase": "stroke", "gesture": pointing.gesture, "bearing_deg": bearing, "bearing_sigma_deg": 8.0}
    yield Tracks(**of, stage="tracker", width=640, height=480, tracks=[face])
    yield HeadPoses(**of, stage="headpose", poses=[head])
    yield Gestures(**of, stage="gesture", gestures=[Gesture(person_id=0, **hand)])


def camera_info():
    """The camera as it tells itself, with the mount that the site file has."""
    return CameraInfo(
        stamp_ns=1, stage="camera", instance="x", state="streaming", source="0", width=640, height=480, mount=BELIEVED,
        camera_matrix=(FOCAL, 0, 319.5, 0, FOCAL, 239.5, 0, 0, 1),
    )  # fmt: skip


def write_site(path):
    """The site file, with comments of its owner's."""
    pois = "\n".join(f"  - {{ poi_id: {name}, position_m: {list(poi.position_m)} }} # {name}" for name, poi in POIS.items())
    mount = "mount: { position_m: [0.1, 0.0, 1.3], yaw_deg: 0.0, pitch_up_deg: 3.0 } # by protractor"
    path.write_text(f"# the hall\ncamera:\n  {mount}\npois:\n{pois}\n")
