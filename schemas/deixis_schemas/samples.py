"""One sample of every type: the source of the golden bytes, and something to look at when writing a stage elsewhere."""

from __future__ import annotations

import struct

from . import messages as m

STAMP_NS = 1_700_000_000_000_000_000
CAMERA = m.Producer("camera", "robot-1")

FRAME = m.Frame(
    run=3,
    seq=7,
    stamp_ns=STAMP_NS,
    stage="camera",
    instance="robot-1",
    width=2,
    height=2,
    encoding="bgr8",
    data=bytes(range(12)),
)

_EVIDENCE = [
    m.Evidence(
        source="gesture",
        producer="gesture/edge-3",
        status="ok",
        observed="point_left",
        age_ms=12.5,
        weight=0.9,
        masses=[m.FocalSet(poi_ids=["vase"], size=1, mass=0.9), m.FocalSet(poi_ids=["vase", "door"], size=2, mass=0.1)],
    ),
    m.Evidence(source="headpose", status="dead", observed="nothing: the stage is silent", weight=0.0),
]
_POIS = [
    m.PoiBelief(poi_id="vase", mass=0.9, belief=0.9, plausibility=1.0, pignistic=0.95, probability=0.97, bearing_deg=61.5),
    m.PoiBelief(poi_id="door", mass=0.0, belief=0.0, plausibility=0.1, pignistic=0.05, probability=0.03, bearing_deg=-170.0),
]
_EXCLUDED = [m.Excluded(poi_id="clock", reason="behind a wall")]
_TARGET = m.Target.derive(
    FRAME,
    m.Producer("fusion", "edge-4"),
    episode_id="edge-4-1",
    person_id=0,
    final=True,
    poi_ids=["vase"],
    pois=_POIS,
    pois_total=2,
    conflict=0.0,
    credible=["vase"],
    credible_total=1,
    excluded=_EXCLUDED,
    excluded_total=1,
    evidence=_EVIDENCE,
    reason="points to the left; only the vase lies there",
    started_ns=STAMP_NS - 1_500_000_000,
    ended_ns=STAMP_NS,
    latency_ms=31.0,
    latency_uncertain_ms=1.0,
)
_PERSON = m.PersonBelief(
    person_id=0,
    position_m=(1.9, 0.1, 1.6),
    distance_m=1.91,
    pois=_POIS,
    pois_total=2,
    unknown=0.1,
    conflict=0.0,
    credible=["vase"],
    credible_total=1,
    excluded=_EXCLUDED,
    excluded_total=1,
    evidence=_EVIDENCE,
    episode_id="edge-4-1",
)
_POI = m.Poi(
    poi_id="vase",
    name="the blue vase",
    position_m=(3.4, 1.67, 1.26),
    extent_m=0.3,
    tags=["ceramics"],
    edited_by="anna@desk",
    edited_ns=STAMP_NS,
)
_ROBOT_POSE = m.RobotPose(stamp_ns=STAMP_NS, stage="robot", instance="base-1", x_m=1.0, y_m=-2.0, yaw_deg=90.0)

SAMPLES: tuple[m.Message, ...] = (
    FRAME,
    m.CameraInfo(
        stamp_ns=STAMP_NS,
        stage="camera",
        instance="robot-1",
        state="streaming",
        source="/dev/video0",
        width=640,
        height=480,
        rate_hz=30.0,
        camera_matrix=(560.0, 0.0, 319.5, 0.0, 560.0, 239.5, 0.0, 0.0, 1.0),
        distortion_model="plumb_bob",
        distortion=[0.01, -0.02, 0.0, 0.0, 0.0],
        intrinsics="calibration camera_info.yaml",
        mount=m.CameraMount(position_m=(0.1, 0.0, 1.3), yaw_deg=0.0, pitch_up_deg=2.5, roll_deg=-0.5),
        run=3,
        last_seq=7,
    ),
    m.Tracks.derive(
        FRAME,
        m.Producer("tracker", "edge-1"),
        width=640,
        height=480,
        tracks=[
            m.Track(
                track_id=1,
                person_id=0,
                kind="face",
                kind_probabilities=m.KindProbabilities(face=0.97, left_hand=0.01, right_hand=0.01, unknown=0.01),
                centroid_px=(320.5, 160.25),
                bbox_px=(290.0, 125.0, 60.0, 72.0),
                velocity_px_s=(1.5, -0.5),
                contour=struct.pack("<8h", 290, 125, 349, 125, 349, 196, 290, 196),
                frontal=m.FrontalFace(centre_px=(320.0, 158.0), width_px=61.0),
                confidence=0.97,
            )
        ],
    ),
    m.HeadPoses.derive(
        FRAME,
        m.Producer("headpose", "edge-2"),
        poses=[
            m.HeadPose(
                person_id=0,
                status="tracking",
                yaw_deg=58.5,
                yaw_sigma_deg=4.0,
                pitch_deg=-6.0,
                roll_deg=1.0,
                covariance_deg2=(16.0, -1.5, 0.5, 9.0, 0.25, 4.0),
                face_width_px=59.5,
            ),
            m.HeadPose(person_id=1, status="out_of_range", side="right", beyond_deg=130.0),
        ],
    ),
    m.Gestures.derive(
        FRAME,
        m.Producer("gesture", "edge-3"),
        gestures=[
            m.Gesture(
                person_id=0,
                phase="stroke",
                gesture="point_left",
                hand="left",
                fingertips_px=[(512.0, 210.0)],
                bearing_deg=62.0,
                bearing_sigma_deg=15.0,
                bearing_mirrored=True,
                elevation_deg=-12.5,
                elevation_sigma_deg=14.0,
                point_probability=0.93,
                point_log_odds={"posture": 2.1, "way": 0.5},
                hand_posture="index",
                hand_posture_probability=0.88,
            )
        ],
    ),
    m.Belief.derive(FRAME, m.Producer("fusion", "edge-4"), persons=[_PERSON], missing=["headpose"]),
    _TARGET,
    m.State(
        stamp_ns=STAMP_NS,
        stage="fusion",
        instance="edge-4",
        robot="r1",
        sources=[m.SourceState(stage="gesture", status="ok", producers=["gesture/edge-3"], age_s=0.02, received=7)],
        robot_pose=_ROBOT_POSE,
        pois=[_POI],
        pois_total=1,
        persons=[_PERSON],
        run=3,
        last_seq=7,
        recent_targets=[_TARGET],
        edits_accepted=1,
        edits_rejected=1,
        rejected_edits=[m.RejectedEdit(key="deixis/r1/fusion/poi/x", reason="position_m: Field required", stamp_ns=STAMP_NS)],
    ),
    _POI,
    _ROBOT_POSE,
    m.Health(
        stamp_ns=STAMP_NS,
        stage="tracker",
        instance="edge-1",
        count=12,
        state="ok",
        pid=4242,
        host="edge",
        uptime_s=12.0,
        cpu_s=4.5,
        rss_mb=120.0,
        step_ms_p50=11.0,
        step_ms_max=24.0,
        inputs=[m.InputHealth(key="deixis/r1/camera/frame", received=360, used=358, overwritten=2, rate_hz=30.0)],
        outputs=[m.OutputHealth(key="deixis/r1/tracker/tracks", published=358, rate_hz=29.8)],
        counters={"faces_detected": 40},
        notes=["the picture is scaled down"],
        versions={"deixis-schemas": "0.1.0", "deixis-tracker": "0.1.0", "eclipse-zenoh": "1.10.2"},
        clocks=[m.ClockHealth(stage="camera", host="robot", ahead_s=-0.012, uncertain_s=0.001)],
    ),
    m.Voice(stamp_ns=STAMP_NS, stage="headpose", instance="edge-2", state="yields", other="edge-9", run=3, seq=22),
)
