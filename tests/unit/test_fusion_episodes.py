"""Pointing episodes, and the core from joined frames to beliefs and targets."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import pytest
from deixis_fusion.config import FusionConfig
from deixis_fusion.episodes import EpisodeTracker, Stroke
from deixis_fusion.evidence import Sample
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_fusion.localisation import RobotPlace
from deixis_fusion.robust import weigh
from deixis_fusion.shown import shown_over
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import (
    Belief,
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
from hypothesis import given, settings
from hypothesis import strategies as st

CONFIG = FusionConfig()
FPS = 30
K = (560.0, 0.0, 319.5, 0.0, 560.0, 239.5, 0.0, 0.0, 1.0)
# The person stands 2 m ahead of the robot; POIs 2.5 m around the person, by their bearing.
BEARINGS = {"b": -120, "c": -90, "d": -60, "e": -30, "f": 30, "g": 60, "h": 90, "i": 120}


def stamp(frame: int) -> int:
    return 10**12 + frame * 10**9 // FPS


def gesture(kind: str = "point_left", phase: str = "stroke", **more: Any) -> Gesture:
    return Gesture.model_validate({"person_id": 1, "phase": phase, "gesture": kind} | more)


def pose(yaw: float | None, status: str = "tracking", **more: Any) -> HeadPose:
    sigma = 3.0 if yaw is not None else None
    return HeadPose.model_validate({"person_id": 1, "status": status, "yaw_deg": yaw, "yaw_sigma_deg": sigma} | more)


REST = gesture("none", "idle")


def sample(frame: int, hand: Gesture | None, head: HeadPose | None) -> Sample:
    return Sample(stamp(frame), stamp(frame), hand, head)


def follow(story: list[tuple[int, Gesture | None]]) -> list[Stroke]:
    """The episodes that come of (number of frames, gesture) in turn."""
    tracker, ended, frame = EpisodeTracker(1, CONFIG.episodes), [], 0
    for count, shown in story:
        for _ in range(count):
            ended.append(tracker.observe(sample(frame, shown, pose(60))))
            frame += 1
    ended.append(tracker.finish())
    return [stroke for stroke in ended if stroke is not None]


def test_one_stroke_is_one_episode() -> None:
    (stroke,) = follow([(10, REST), (45, gesture()), (20, REST)])
    assert (stroke.first.stamp_ns, stroke.last.stamp_ns) == (stamp(10), stamp(54))
    assert len(stroke.samples) == 45


def test_a_stroke_that_is_too_short_is_no_episode() -> None:
    assert follow([(10, REST), (6, gesture()), (30, REST)]) == []


@pytest.mark.parametrize("shown", [gesture("other"), gesture("none", "idle"), gesture("point_left", "preparation"), None])
def test_what_is_not_a_pointing_stroke_is_no_episode(shown: Gesture | None) -> None:
    assert follow([(90, shown)]) == []


def test_an_invisible_finger_is_an_episode() -> None:
    assert len(follow([(45, gesture("invisible"))])) == 1


def test_a_brief_drop_out_does_not_split_an_episode_and_a_long_one_does() -> None:
    assert len(follow([(20, gesture()), (8, gesture(phase="preparation")), (20, gesture())])) == 1
    assert len(follow([(20, gesture()), (12, REST), (20, gesture())])) == 2


def test_a_hand_held_on_stays_in_its_episode_while_its_outline_tells_nothing() -> None:
    unclear = gesture("none", "stroke")
    (stroke,) = follow([(20, gesture()), (20, unclear), (20, gesture())])
    assert len(stroke.samples) == 40
    assert len(follow([(20, gesture()), (40, unclear), (20, gesture())])) == 2
    assert follow([(90, unclear)]) == []


def test_a_stroke_that_is_mostly_an_open_hand_is_no_episode() -> None:
    assert follow([(4, gesture("other")), (1, gesture())] * 10) == []


def test_a_hand_that_swings_to_the_other_side_begins_another_episode() -> None:
    first, second = follow([(30, gesture("point_left")), (3, REST), (30, gesture("point_right")), (20, REST)])
    assert {shown.pointing for shown in first.samples} == {"point_left"}
    assert {shown.pointing for shown in second.samples} == {"point_right"}


def test_a_flicker_of_the_other_side_does_not_split_an_episode() -> None:
    assert len(follow([(15, gesture("point_left")), (3, gesture("point_right")), (15, gesture("point_left"))])) == 1


def test_every_episode_has_an_id_of_its_own() -> None:
    strokes = follow([(20, gesture()), (20, REST)] * 3)
    assert len({stroke.episode_id for stroke in strokes}) == 3


def test_evidence_is_bounded_however_long_the_hand_is_held() -> None:
    tracker = EpisodeTracker(1, CONFIG.episodes)
    for frame in range(3000):
        tracker.observe(sample(frame, gesture(), None))
    assert tracker.stroke is not None
    assert len(tracker.stroke.samples) <= CONFIG.episodes.max_evidence_s * FPS + 2


# --- evidence of a stroke ---------------------------------------------------------------------------------------------


def samples(hands: Sequence[Gesture | None], heads: Sequence[HeadPose | None]) -> list[Sample]:
    return [sample(i, hand, head) for i, (hand, head) in enumerate(zip(hands, heads, strict=True))]


def test_more_frames_do_not_make_a_stroke_more_certain() -> None:
    short = shown_over(weigh(samples([gesture()] * 20, [pose(60)] * 20), 0.2)).head
    long = shown_over(weigh(samples([gesture()] * 200, [pose(60)] * 200), 0.2)).head
    assert short == long
    assert short is not None
    assert short.yaw_sigma_deg == pytest.approx(3.0)


def test_the_head_on_its_way_and_outliers_hardly_count() -> None:
    yaws = [10, 20, 30, 40, 50] + [60.0] * 20 + [-150.0] * 3
    head = shown_over(weigh(samples([gesture()] * 28, [pose(yaw) for yaw in yaws]), 0.2)).head
    assert head is not None
    assert head.yaw_deg == pytest.approx(60)


def test_a_head_mostly_out_of_range_is_out_of_range_to_its_side() -> None:
    heads = [pose(90)] * 8 + [pose(None, "out_of_range", side="left")] * 20
    head = shown_over(weigh(samples([gesture()] * 28, heads), 0.2)).head
    assert head is not None
    assert (head.yaw_deg, head.side) == (None, "left")


@pytest.mark.parametrize("shown", [None, pose(None, "lost"), pose(None, "initialising")])
def test_a_head_that_was_not_tracked_says_nothing(shown: HeadPose | None) -> None:
    assert shown_over(weigh(samples([gesture()] * 30, [shown] * 30), 0.2)).head is None


def test_the_hand_goes_by_the_vote_and_a_finger_seen_now_and_then_counts() -> None:
    kinds = ["point_left"] * 12 + ["invisible"] * 18
    hand = shown_over(weigh(samples([gesture(kind, hand="left") for kind in kinds], [None] * 30), 0.0)).hand
    assert hand is not None
    assert (hand.gesture, hand.hand) == ("point_left", "left")
    hand = shown_over(weigh(samples([gesture("invisible")] * 28 + [gesture()] * 2, [None] * 30), 0.0)).hand
    assert hand is not None
    assert hand.gesture == "invisible"


def test_mirrored_bearings_are_taken_from_the_front_whichever_was_named() -> None:
    told = [gesture(bearing_deg=b, bearing_sigma_deg=10, bearing_mirrored=True) for b in [50.0, 130.0, 52.0, 128.0, 51.0]]
    hand = shown_over(weigh(samples([*told], [None] * 5), 0.0)).hand
    assert hand is not None
    assert hand.bearing_deg == pytest.approx(51, abs=1)
    assert hand.mirrored


# --- the core ---------------------------------------------------------------------------------------------------------


class Scene:
    """A person before the robot, told frame by frame."""

    def __init__(self, config: FusionConfig = CONFIG, robot: RobotPlace = RobotPlace()) -> None:  # noqa: B008
        self.fusion = Fusion(config, Producer("fusion", "test"))
        content = {
            "stamp_ns": 0,
            "stage": "camera",
            "instance": "c",
            "state": "streaming",
            "source": "",
            "width": 640,
            "height": 480,
        }
        self.fusion.set_camera(CameraInfo.model_validate(content | {"camera_matrix": K}))
        self.fusion.start_robot_at(robot)
        self.robot = robot
        self.pois = [self.poi(poi_id, bearing) for poi_id, bearing in BEARINGS.items()]
        self.fusion.set_pois(self.pois)
        self.frame, self.run, self.shift_ns = 0, 1, 0
        self.beliefs: list[Belief] = []
        self.targets: list[Target] = []

    def poi(self, poi_id: str, bearing: float) -> Poi:
        """A POI 2.5 m from the person at that bearing; the camera is at base_link."""
        direction = math.pi + math.radians(bearing)
        x, y = 2 + 2.5 * math.cos(direction), 2.5 * math.sin(direction)
        cos, sin = math.cos(math.radians(self.robot.yaw_deg)), math.sin(math.radians(self.robot.yaw_deg))
        return Poi(poi_id=poi_id, position_m=(self.robot.x_m + x * cos - y * sin, self.robot.y_m + x * sin + y * cos, 1.3))

    def show(
        self,
        count: int,
        hand: Gesture | None,
        head: HeadPose | None,
        *,
        person: bool = True,
        without: tuple[str, ...] = (),
        statuses: dict[str, Any] | None = None,
        now_ns: int | None = None,
    ) -> None:
        """So many frames of this."""
        for _ in range(count):
            about: dict[str, Any] = {"run": self.run, "seq": self.frame, "stamp_ns": stamp(self.frame) + self.shift_ns}
            about["instance"] = "x"
            width = 560 * FACE_WIDTH_M / 2
            face = Track.model_validate(
                {"track_id": 1, "person_id": 1, "kind": "face", "kind_probabilities": {"face": 1}, "centroid_px": (320, 240)}
                | {"bbox_px": (320 - width / 2, 215, width, 60), "velocity_px_s": (0, 0)}
            )
            tracks = Tracks(**about, stage="tracker", width=640, height=480, tracks=[face] if person else [])
            poses = HeadPoses(**about, stage="headpose", poses=[head] if head else [])
            gestures = Gestures(**about, stage="gesture", gestures=[hand] if hand else [])
            frame = JoinedFrame(
                tracks=None if "tracker" in without else tracks,
                poses=None if "headpose" in without else poses,
                gestures=None if "gesture" in without else gestures,
                missing=without,
            )
            belief, targets = self.fusion.answer(frame, statuses or {}, now_ns)
            self.beliefs.append(belief)
            self.targets += targets
            self.frame += 1

    @property
    def finals(self) -> list[Target]:
        return [target for target in self.targets if target.final]


def point(scene: Scene, bearing: float, **more: Any) -> None:
    side = "point_left" if bearing > 0 else "point_right"
    hand = gesture(side, hand="left" if bearing > 0 else "right", bearing_deg=bearing, bearing_sigma_deg=10)
    scene.show(15, REST, pose(0))
    scene.show(45, hand, pose(bearing), **more)
    scene.show(20, REST, pose(0))


@pytest.mark.parametrize(("poi_id", "bearing"), [(p, b) for p, b in BEARINGS.items() if abs(b) <= 90])
@pytest.mark.parametrize("robot", [RobotPlace(), RobotPlace(3, -2, 130)])
def test_pointing_and_looking_at_a_poi_names_it_once(poi_id: str, bearing: float, robot: RobotPlace) -> None:
    scene = Scene(robot=robot)
    point(scene, bearing)
    (final,) = scene.finals
    assert final.poi_ids == [poi_id]
    assert final.pois[0].poi_id == poi_id
    assert final.pois[0].bearing_deg == pytest.approx(bearing, abs=1.5)
    assert f"'{poi_id}'" in final.reason
    assert (final.started_ns, final.ended_ns) == (stamp(15), stamp(59))
    assert final.latency_ms == 0
    assert {target.episode_id for target in scene.targets} == {final.episode_id}
    assert scene.targets[-1] is final


def test_a_head_turned_far_and_the_hand_name_a_poi_behind() -> None:
    scene = Scene()
    scene.show(15, REST, pose(0))
    hand = gesture("point_left", bearing_deg=60, bearing_sigma_deg=10, bearing_mirrored=True)
    scene.show(45, hand, pose(115))
    scene.show(20, REST, pose(0))
    assert scene.finals[0].poi_ids == ["i"]


def test_every_frame_has_one_belief_with_bearings_also_without_a_gesture() -> None:
    scene = Scene()
    scene.show(10, REST, pose(None, "lost"))
    assert [belief.seq for belief in scene.beliefs] == list(range(10))
    (person,) = scene.beliefs[-1].persons
    assert {row.poi_id: round(row.bearing_deg or 0) for row in person.pois} == pytest.approx(BEARINGS, abs=1)
    assert person.unknown == 1.0
    assert person.position_m is not None
    assert person.position_m[:2] == pytest.approx((2, 0), abs=0.02)
    assert scene.targets == []


def test_the_heads_word_is_shown_without_a_gesture_but_makes_no_target() -> None:
    scene = Scene()
    scene.show(60, REST, pose(60))
    (person,) = scene.beliefs[-1].persons
    assert max(person.pois, key=lambda row: row.pignistic).poi_id == "g"
    assert [(e.source, e.status) for e in person.evidence] == [("gesture", "ok"), ("headpose", "ok")]
    assert person.evidence[0].weight == 0
    assert person.evidence[1].observed == "yaw 60.0 +- 3.0 deg"
    assert scene.targets == []


def test_a_poi_put_or_deleted_is_seen_in_the_next_belief() -> None:
    scene = Scene()
    scene.show(1, REST, pose(0))
    scene.fusion.set_pois([*scene.pois[1:], Poi(poi_id="new", position_m=(1, 1, 1))])
    scene.show(1, REST, pose(0))
    ids = {row.poi_id for row in scene.beliefs[-1].persons[0].pois}
    assert ids == (set(BEARINGS) - {"b"}) | {"new"}


def test_a_wall_takes_a_poi_out_of_the_frame_of_discernment() -> None:
    scene = Scene()
    scene.fusion.set_walls([((1.0, -1.2), (3.0, -1.2))])
    scene.show(1, REST, pose(0))
    assert "h" not in {row.poi_id for row in scene.beliefs[-1].persons[0].pois}
    assert "c" in {row.poi_id for row in scene.beliefs[-1].persons[0].pois}


def test_nobody_tracked_gives_a_belief_without_persons() -> None:
    scene = Scene()
    scene.show(3, None, None, person=False)
    assert [belief.persons for belief in scene.beliefs] == [[], [], []]


def test_without_pois_every_frame_is_answered_and_pointing_abstains() -> None:
    scene = Scene()
    scene.fusion.set_pois([])
    point(scene, 60)
    (final,) = scene.finals
    assert final.poi_ids == []
    assert "no POI" in final.reason


def test_without_intrinsics_all_pois_are_equally_possible() -> None:
    scene = Scene()
    scene.fusion.set_camera(
        CameraInfo(stamp_ns=0, stage="camera", instance="c", state="streaming", source="", width=640, height=480)
    )
    point(scene, 60)
    assert {row.plausibility for row in scene.beliefs[-1].persons[0].pois} == {1.0}
    assert scene.finals[0].poi_ids == []
    assert "where the person stands is not known" in scene.finals[0].reason


DEAD = {"headpose": ("dead", "gone, silent for 2.0 s")}


def test_a_dead_head_stage_never_makes_the_answer_more_certain() -> None:
    alive, dead = Scene(), Scene()
    point(alive, 60)
    point(dead, 60, without=("headpose",), statuses=DEAD)
    assert dead.beliefs[40].missing == ["headpose"]
    gesture_said, head_said = dead.beliefs[40].persons[0].evidence
    assert (head_said.status, head_said.weight, head_said.observed) == ("dead", 0.0, "gone, silent for 2.0 s")
    assert gesture_said.weight > 0
    assert dead.beliefs[40].persons[0].unknown > alive.beliefs[40].persons[0].unknown


def test_a_stage_that_dies_during_a_stroke_counts_for_nothing_from_then_on() -> None:
    scene = Scene()
    scene.show(30, gesture(), pose(60))
    before = scene.beliefs[-1].persons[0]
    scene.show(5, gesture(), None, without=("headpose",), statuses=DEAD)
    after = scene.beliefs[-1].persons[0]
    assert (after.evidence[1].status, after.evidence[1].weight) == ("dead", 0.0)
    assert after.unknown > before.unknown


NO_GESTURE = {"gesture": ("dead", "gone, silent for 2.0 s")}


@pytest.mark.parametrize(("dying", "statuses"), [("gesture", NO_GESTURE), ("headpose", DEAD)])
def test_a_stage_that_dies_between_two_that_contradict_each_other_decides_nothing(dying: str, statuses: dict[str, Any]) -> None:
    scene = Scene()
    hand = gesture("point_left", hand="left", bearing_deg=60.0, bearing_sigma_deg=20)
    scene.show(30, hand, pose(-56))
    before = scene.beliefs[-1].persons[0].pois
    scene.show(8, hand, pose(-56), without=(dying,), statuses=statuses)
    after = scene.beliefs[-1].persons[0].pois
    assert max(row.pignistic for row in after) <= max(row.pignistic for row in before) + 1e-9
    assert (after[0].probability or 1) <= (before[0].probability or 0) + 1e-9
    scene.fusion.end(None)
    answers = [set(target.poi_ids) for target in scene.targets]
    assert answers[-1] == answers[0] or len(answers[-1]) != 1


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from(["point_left", "point_right", "invisible"]),
    st.integers(-150, 150),
    st.sampled_from([5.0, 10.0, 25.0]),
    st.integers(-120, 120) | st.none(),
    st.sampled_from(["gesture", "headpose"]),
)
def test_whatever_is_seen_a_dying_stage_makes_no_answer_more_certain(
    kind: str, bearing: int, sigma: float, yaw: int | None, dying: str
) -> None:
    scene, statuses = Scene(), {dying: ("dead", "gone, silent for 2.0 s")}
    hand = gesture(kind, hand="left", bearing_deg=float(bearing), bearing_sigma_deg=sigma)
    head = pose(float(yaw)) if yaw is not None else pose(None, "out_of_range", side="left", beyond_deg=100.0)
    scene.show(20, hand, head)
    before = scene.beliefs[-1].persons[0]
    scene.show(5, hand, head, without=(dying,), statuses=statuses)
    after = scene.beliefs[-1].persons[0]
    for name in ("probability", "pignistic"):
        most = max(getattr(row, name) for row in before.pois)
        assert max(getattr(row, name) for row in after.pois) <= most + 1e-9
    assert after.credible_total >= before.credible_total
    (gone,) = (said for said in after.evidence if said.source == dying)
    assert (gone.status, gone.weight) == ("dead", 0.0)


@pytest.mark.parametrize("yaw", [50, 70, -60])
def test_a_head_lost_beyond_45_degrees_is_not_read_as_out_of_range(yaw: float) -> None:
    """However far it was turned when it was lost: what is not seen says nothing, and certainly not that it is out there."""
    hand = gesture("invisible")
    lost, unseen, beyond = Scene(), Scene(), Scene()
    for scene, head in ((lost, pose(None, "lost")), (unseen, None), (beyond, pose(None, "out_of_range", beyond_deg=100.0))):
        scene.show(3, REST, pose(yaw))
        scene.show(30, hand, head)
    told, nothing, far = (scene.beliefs[-1].persons[0] for scene in (lost, unseen, beyond))
    assert (told.evidence[1].status, told.evidence[1].observed, told.evidence[1].weight) == ("not_tracking", "head lost", 0.0)
    assert [row.probability for row in told.pois] == [row.probability for row in nothing.pois]
    assert [row.poi_id for row in told.pois] != [row.poi_id for row in far.pois]


def test_a_stage_that_lives_again_is_heard_again() -> None:
    scene = Scene()
    scene.show(20, gesture(bearing_deg=60.0, bearing_sigma_deg=10), pose(60))
    sure = scene.beliefs[-1].persons[0].pois[0].pignistic
    scene.show(4, gesture(bearing_deg=60.0, bearing_sigma_deg=10), None, without=("headpose",), statuses=DEAD)
    scene.show(20, gesture(bearing_deg=60.0, bearing_sigma_deg=10), pose(60))
    assert scene.beliefs[-1].persons[0].pois[0].pignistic >= 0.95 * sure


def test_a_stage_late_for_some_frames_of_a_stroke_still_counts_and_for_long_does_not() -> None:
    scene = Scene()
    scene.show(30, gesture(), pose(60))
    scene.show(5, gesture(), None, without=("headpose",))
    said = scene.beliefs[-1].persons[0].evidence[1]
    assert (said.status, said.weight > 0.5) == ("late", True)
    scene.show(30, gesture(), None, without=("headpose",))
    said = scene.beliefs[-1].persons[0].evidence[1]
    assert (said.status, said.weight) == ("late", 0.0)


def test_a_person_whom_the_head_stage_does_not_know_is_not_tracked_by_it() -> None:
    scene = Scene()
    scene.show(5, REST, None)
    said = scene.beliefs[-1].persons[0].evidence[1]
    assert (said.status, said.weight, said.producer) == ("not_tracking", 0.0, "headpose/x")


def test_a_person_lost_in_mid_stroke_gets_one_final_answer() -> None:
    scene = Scene()
    scene.show(30, gesture(bearing_deg=60, bearing_sigma_deg=10), pose(60))
    scene.show(40, None, None, person=False)
    (final,) = scene.finals
    assert final.poi_ids == ["g"]
    assert scene.fusion.open_episodes() == []


def test_when_the_source_ends_open_episodes_get_their_final_answer_once() -> None:
    scene = Scene()
    scene.show(30, gesture(bearing_deg=60, bearing_sigma_deg=10), pose(60))
    assert len(scene.fusion.open_episodes()) == 1
    (final,) = scene.fusion.end(None)
    assert (final.final, final.poi_ids, final.seq) == (True, ["g"], 29)
    assert scene.fusion.end(None) == []


def test_updates_come_on_change_and_at_a_bounded_rate() -> None:
    scene = Scene()
    scene.show(60, gesture(bearing_deg=60, bearing_sigma_deg=10), pose(60))
    scene.show(60, gesture(bearing_deg=60, bearing_sigma_deg=10), pose(62))
    updates = [target for target in scene.targets if not target.final]
    assert 1 <= len(updates) <= 5
    gaps = [b.stamp_ns - a.stamp_ns for a, b in itertools.pairwise(updates)]
    assert all(gap >= CONFIG.answer.update_every_s * 1e9 for gap in gaps)


def test_ages_and_latency_are_told_where_time_runs() -> None:
    scene = Scene()
    scene.show(30, gesture(), pose(60), now_ns=stamp(30) + 50_000_000)
    (final,) = scene.fusion.end(stamp(29) + 80_000_000)
    assert final.latency_ms == pytest.approx(80, abs=1)
    assert final.evidence[0].age_ms == pytest.approx(80, abs=1)


def test_two_runs_on_the_same_input_are_equal() -> None:
    one, other = Scene(), Scene()
    for scene in (one, other):
        point(scene, 60)
        point(scene, -30)
    assert one.beliefs == other.beliefs
    assert one.targets == other.targets


def test_the_papers_rules_answer_too() -> None:
    scene = Scene(FusionConfig(rules="paper"))
    point(scene, 60)
    assert scene.finals[0].poi_ids == ["g"]
    assert scene.finals[0].evidence[0].masses[0].poi_ids == ["f", "g", "h", "i"][1:]


def test_what_the_robot_does_not_see_is_no_poi_by_the_papers_rules() -> None:
    scenes = {rules: Scene(FusionConfig(rules=rules)) for rules in ("paper", "deixis")}
    for scene in scenes.values():
        # Halfway between the robot and the POI that is meant, beside the line from person to POI.
        x, y, _ = scene.poi("g", 60).position_m
        scene.fusion.set_walls([((x / 2 - 0.3, y / 2), (x / 2 + 0.3, y / 2))])
        point(scene, 60)
    assert scenes["deixis"].finals[0].poi_ids == ["g"]
    final = scenes["paper"].finals[0]
    assert "g" not in final.poi_ids
    assert {told.poi_id: told.reason for told in final.excluded} == {
        "f": "behind a wall",
        "g": "behind a wall for the robot",
    }
    assert final.excluded_total == 2
    assert "; behind a wall: 'f'; behind a wall for the robot: 'g'" in final.reason
    assert [told.poi_id for told in scenes["deixis"].finals[0].excluded] == ["f"]


def test_masses_of_every_source_are_shown_and_sum_to_one() -> None:
    scene = Scene()
    point(scene, 60)
    for said in scene.finals[0].evidence:
        assert sum(focal.mass for focal in said.masses) == pytest.approx(1.0)


# --- runs and clocks --------------------------------------------------------------------------------------------------


def test_a_clock_set_back_by_forty_milliseconds_neither_ends_nor_prolongs_an_episode() -> None:
    steady, stepped = Scene(), Scene()
    for scene in (steady, stepped):
        scene.show(15, REST, pose(0))
        scene.show(40, gesture(bearing_deg=60, bearing_sigma_deg=10), pose(60))
        scene.show(4, REST, pose(0))
        scene.shift_ns = -40_000_000 if scene is stepped else 0
        scene.show(4, REST, pose(0))
        assert scene.finals == []
        scene.show(4, REST, pose(0))
    (before,), (after,) = steady.finals, stepped.finals
    assert (after.seq, after.poi_ids, after.started_ns, after.ended_ns) == (before.seq, ["g"], stamp(15), stamp(54))
    assert after.stamp_ns == before.stamp_ns - 40_000_000


def test_a_clock_set_back_by_an_hour_does_not_keep_a_place_for_an_hour() -> None:
    scene = Scene()
    scene.show(5, REST, pose(0))
    scene.shift_ns = -(10**12)
    scene.show(5, REST, pose(0))
    assert scene.beliefs[-1].persons[0].position_m is not None
    scene.show(70, None, None, person=False)
    scene.show(1, None, None, without=("tracker",))
    assert scene.fusion.persons == []


def test_a_new_run_ends_the_episodes_of_the_last_and_forgets_its_persons() -> None:
    scene = Scene()
    scene.show(30, gesture(bearing_deg=60, bearing_sigma_deg=10), pose(60))
    (episode_id,) = scene.fusion.open_episodes()
    scene.run, scene.frame = 2, 0
    scene.show(1, gesture(), pose(60))
    (final,) = scene.finals
    assert (final.episode_id, final.poi_ids, final.frame_id) == (episode_id, ["g"], (1, 29))
    assert scene.beliefs[-1].frame_id == (2, 0)
    assert scene.beliefs[-1].persons[0].episode_id is None
    assert scene.fusion.open_episodes() == []


def test_the_robots_pose_is_that_of_the_frames_stamp() -> None:
    scene = Scene()
    for i in range(10):
        turned = {"x_m": 0, "y_m": 0, "yaw_deg": math.degrees(0.1 * i)}
        about = {"stage": "robot", "instance": "r", "stamp_ns": stamp(0) + i * 10**8}
        scene.fusion.hear_robot(RobotPose.model_validate(about | turned))
    scene.show(1, REST, pose(0))
    (person,) = scene.beliefs[-1].persons
    assert person.position_m is not None
    assert person.position_m[:2] == pytest.approx((2, 0), abs=0.02)
    assert [said.source for said in person.evidence] == ["gesture", "headpose"]


def test_an_old_pose_of_the_robot_is_used_and_said_in_evidence_and_reason() -> None:
    scene = Scene()
    about = {"stage": "robot", "instance": "r", "stamp_ns": stamp(0) - 3 * 10**9}
    scene.fusion.hear_robot(RobotPose.model_validate(about | {"x_m": 0, "y_m": 0, "yaw_deg": 0}))
    point(scene, 60)
    (final,) = scene.finals
    assert final.poi_ids == ["g"]
    assert final.evidence[2].source == "robot"
    assert (final.evidence[2].status, final.evidence[2].weight) == ("late", 0)
    assert "s older than the frame" in final.evidence[2].observed
    assert "robot/pose is in doubt" in final.reason
    assert "s older than the frame" in scene.fusion.robot_doubt


def test_the_mirror_of_minus_sixty_is_minus_one_hundred_and_twenty() -> None:
    scene = Scene()
    hand = gesture("point_right", bearing_deg=-60, bearing_sigma_deg=10, bearing_mirrored=True)
    scene.show(30, hand, pose(-60))
    (final,) = scene.fusion.end(None)
    assert final.evidence[0].observed == "point_right, bearing -60.0 or -120.0 +- 10.0 deg"
    assert "(about -60 or -120 +- 10 deg)" in final.reason
