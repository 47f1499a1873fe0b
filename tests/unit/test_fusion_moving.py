"""A robot that drives while somebody points, and somebody who walks and points: angles are rays in the map, each from then."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from deixis_fusion import weighing
from deixis_fusion.config import FusionConfig
from deixis_fusion.evidence import Evidence, Sample, Witness
from deixis_fusion.frames import FrameLog, Frames
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_fusion.localisation import PersonPlace
from deixis_fusion.robust import middles_of
from deixis_fusion.shown import shown_over
from deixis_fusion.sight import Lookout, Points
from deixis_fusion.views import last_place, parts_of, views_of
from deixis_fusion.visibility import Walls
from deixis_fusion.walk import MOST_VIEWS
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import (
    CameraInfo,
    Gesture,
    Gestures,
    HeadPose,
    HeadPoses,
    Poi,
    Producer,
    RobotPose,
    Target,
    Track,
    Tracks,
)

FPS, FOCAL = 30, 560.0
K = (FOCAL, 0.0, 319.5, 0.0, FOCAL, 239.5, 0.0, 0.0, 1.0)
INFO = {"stamp_ns": 0, "stage": "camera", "instance": "c", "state": "streaming", "source": "", "width": 640, "height": 480}
Spot = tuple[float, float]
# Where somebody is after so many seconds, map, metres; of the robot with its yaw in degrees.
Way = Callable[[float], Spot]


def stamp(frame: int) -> int:
    return 10**12 + frame * 10**9 // FPS


def direction(a: Spot, b: Spot) -> float:
    return math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))


def wrapped(angle: float) -> float:
    return (angle + 180) % 360 - 180


def pointing(robot: Way, person: Way, meant: Spot, pois: dict[str, Spot], seconds: float = 4.0, rest: float = 0.0) -> Target:
    """The final answer to somebody who points at a place, then for a while not. The robot turns its camera to the person."""
    fusion = Fusion(FusionConfig(), Producer("fusion", "test"))
    fusion.set_camera(CameraInfo.model_validate(INFO | {"camera_matrix": K}))
    fusion.set_pois([Poi(poi_id=name, position_m=(*spot, 1.3), extent_m=0.2) for name, spot in pois.items()])
    targets: list[Target] = []
    for frame in range(int((seconds + rest) * FPS)):
        at, who = robot(frame / FPS), person(frame / FPS)
        yaw = direction(at, who)
        about = {"stage": "robot", "instance": "r", "stamp_ns": stamp(frame)}
        fusion.hear_robot(RobotPose.model_validate(about | {"x_m": at[0], "y_m": at[1], "yaw_deg": yaw}))
        bearing = wrapped(direction(who, meant) - direction(who, at))
        idle = {"phase": "idle", "gesture": "none"} if frame >= seconds * FPS else {}
        targets += fusion.answer(_frame(frame, math.dist(at, who), bearing, idle), {}, None)[1]
    (final,) = (target for target in [*targets, *fusion.end(None)] if target.final)
    return final


def _frame(seq: int, distance: float, bearing: float, gesture: dict[str, Any]) -> JoinedFrame:
    about: dict[str, Any] = {"run": 1, "seq": seq, "stamp_ns": stamp(seq), "instance": "x"}
    width = FOCAL * FACE_WIDTH_M / distance
    face = Track.model_validate(
        {"track_id": 1, "person_id": 1, "kind": "face", "kind_probabilities": {"face": 1}, "centroid_px": (320, 240)}
        | {"bbox_px": (320 - width / 2, 215, width, 60), "velocity_px_s": (0, 0)}
    )
    side = "point_left" if bearing > 0 else "point_right"
    hand = {"person_id": 1, "phase": "stroke", "gesture": side, "bearing_deg": bearing, "bearing_sigma_deg": 8.0} | gesture
    pose = {"person_id": 1, "status": "tracking", "yaw_deg": bearing, "yaw_sigma_deg": 3.0}
    return JoinedFrame(
        Tracks(**about, stage="tracker", width=640, height=480, tracks=[face]),
        HeadPoses(**about, stage="headpose", poses=[HeadPose.model_validate(pose)]),
        Gestures(**about, stage="gesture", gestures=[Gesture.model_validate(hand)]),
    )


# Around a person at (2, 0), 2.5 m off, 20 degrees apart.
AROUND = {
    f"d{d}": (2 + 2.5 * math.cos(math.radians(180 + d)), 2.5 * math.sin(math.radians(180 + d))) for d in range(-100, 101, 20)
}


@pytest.mark.parametrize("speed", [0.4, -0.4])
@pytest.mark.parametrize("name", ["d60", "d-60", "d80"])
def test_a_robot_that_drives_past_names_what_is_pointed_at(name: str, speed: float) -> None:
    final = pointing(lambda t: (0.0, speed * t), lambda _: (2.0, 0.0), AROUND[name], AROUND)
    assert final.poi_ids == [name]


@pytest.mark.parametrize("name", ["w2", "w3"])
def test_somebody_who_walks_and_points_means_what_lies_where_all_rays_cross(name: str) -> None:
    shelf = {f"w{i}": (-1.2 + i, 2.8) for i in range(6)}
    final = pointing(lambda _: (0.0, 0.0), lambda t: (2.0, -1.2 + 0.8 * t), shelf[name], shelf, seconds=3)
    assert final.poi_ids == [name]


def test_somebody_who_walks_off_after_pointing_means_what_was_seen_from_there() -> None:
    final = pointing(
        lambda _: (0.0, 0.0),
        lambda t: (2.0, -2.0 * max(0.0, t - 1.5)),
        AROUND["d-80"],
        AROUND,
        seconds=1.5,
        rest=0.5,
    )
    assert final.poi_ids == ["d-80"]
    assert final.pois[0].bearing_deg == pytest.approx(-80, abs=2)


# --- rays -------------------------------------------------------------------------------------------------------------


def sample(frame: int, axis_deg: float, bearing: float, person: Spot = (0.0, 0.0), **more: Any) -> Sample:
    camera = (person[0] + 2 * math.cos(math.radians(axis_deg)), person[1] + 2 * math.sin(math.radians(axis_deg)), 1.2)
    content = {"person_id": 1, "phase": "stroke", "gesture": "point_left", "bearing_deg": bearing, "bearing_sigma_deg": 8.0}
    pose = HeadPose(person_id=1, status="tracking", yaw_deg=bearing, yaw_sigma_deg=3.0)
    place = PersonPlace((*person, 1.6), camera, 2.0, 0.2)
    return Sample(stamp(frame), stamp(frame), Gesture.model_validate(content | more), pose, place)


def test_a_log_that_grows_has_the_same_frames_and_leaves_alone_what_was_taken_from_it() -> None:
    told = [0.5] * 72
    samples = [sample(i, 0, i, bearing_likelihood=told if i % 2 else []) for i in range(150)]
    log = FrameLog(samples[:60])
    early = Frames.of(log)
    before = early.table.copy()
    for one in samples[60:]:
        log.append(one)
    late, anew = Frames.of(log), Frames.of(samples)
    assert (len(early), len(late)) == (60, 150)
    np.testing.assert_array_equal(early.table, before)
    np.testing.assert_array_equal(late.table, anew.table)
    np.testing.assert_array_equal(late.column("bearing_deg"), np.arange(150))
    np.testing.assert_array_equal(late.curves[:, 7], [0.5 if i % 2 else 0 for i in range(150)])


def test_a_ray_stays_where_it_is_in_the_map_while_the_camera_goes_round() -> None:
    weighed = Frames.of([sample(i, axis_deg=i, bearing=wrapped(170 - i)) for i in range(40)])
    hand, head = shown_over(weighed, 39)
    assert hand is not None
    assert head is not None
    assert (hand.bearing_deg, head.yaw_deg) == pytest.approx((131, 131))
    assert (hand.bearing_sigma_deg, head.yaw_sigma_deg) == pytest.approx((8, 3))


def test_what_is_behind_and_what_is_before_come_apart_when_the_camera_goes_round() -> None:
    # Behind at 120 as seen first; the stage names the one in front, or the other, as it comes.
    weighed = Frames.of(
        [sample(i, axis_deg=i, bearing=(120 - i) if i % 2 else 180 - (120 - i), bearing_mirrored=True) for i in range(40)]
    )
    hand = shown_over(weighed, 39).hand
    assert hand is not None
    sigmas = {round(bearing): sigma for bearing, sigma in hand.bearings}
    assert sigmas[81] == pytest.approx(8, abs=8)
    assert max(sigmas.values()) > min(sigmas.values()) + 3


def test_a_curve_of_bearings_turns_with_the_camera() -> None:
    def curve(peak: float) -> list[float]:
        return [math.exp(-0.5 * (wrapped(-180 + 5 * i - peak) / 12) ** 2) for i in range(72)]

    weighed = Frames.of([sample(i, 2 * i, 60 - 2 * i, bearing_likelihood=curve(60 - 2 * i)) for i in range(20)])
    hand = shown_over(weighed, 38).hand
    assert hand is not None
    assert hand.likelihood == pytest.approx(curve(22), abs=0.03)


def test_angles_are_one_cluster_wherever_the_circle_is_cut() -> None:
    (middle,) = middles_of(np.array([[178.0, 179, -179, -178, 180], [0] * 5, [7] * 5, [1] * 5]), 0)
    assert middle == (pytest.approx(-180), pytest.approx(1.48, abs=0.1), 7, 1)


def test_a_walk_has_few_views_whose_shares_are_all_there_is() -> None:
    weighed = Frames.of([sample(i, 180, 60, person=(0.0, 0.05 * i)) for i in range(150)])
    views = views_of(parts_of(weighed), *shown_over(weighed))
    assert 2 < len(views) <= MOST_VIEWS
    assert sum(view.hand_share for view in views) == pytest.approx(1)
    assert sum(view.head_share for view in views) == pytest.approx(1)


def test_who_stands_is_seen_from_one_place() -> None:
    weighed = Frames.of([sample(i, i, 60 - i, person=(0.0, 0.01 * (i % 3))) for i in range(150)])
    assert views_of(parts_of(weighed), *shown_over(weighed)) == ()


def test_of_a_walk_past_very_many_pois_few_cases_say_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    pois = [Poi(poi_id=f"p{i}", position_m=(*rng.uniform(-8, 8, 2), 1.2), extent_m=rng.uniform(0, 1)) for i in range(600)]
    weighed = Frames.of([sample(i, 180, 60 + 0.1 * i, person=(0.0, 0.03 * i)) for i in range(60)])
    hand, head = shown_over(weighed)
    views = views_of(parts_of(weighed), hand, head)
    seen = Lookout(0.15).look(last_place(weighed.samples), Points.of(pois), Walls(()))  # type: ignore[arg-type]
    said = Witness("ok", "")
    curves = weighing.SourceCurves(FusionConfig().hand, FusionConfig().head)
    monkeypatch.setattr(weighing, "MANY", 10_000)
    every = weighing.weigh(Evidence(hand, said, head, said, views), seen, curves)
    monkeypatch.setattr(weighing, "MANY", 100)
    few = weighing.weigh(Evidence(hand, said, head, said, views), seen, curves)
    assert len(views) > 2
    assert few.joint.shape == every.joint.shape
    assert few.chances(1.0) == pytest.approx(every.chances(1.0), abs=0.005)
    likely = every.joint > 0.05 * every.joint.max()
    assert few.joint[likely] == pytest.approx(every.joint[likely], rel=0.2)
