"""Whatever the registry holds and however many stand there, answers and State stay within their limits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from deixis_fusion.assessment import Assessment
from deixis_fusion.config import FusionConfig
from deixis_fusion.decision import Choice, Judgement
from deixis_fusion.evidence import Evidence, HandObservation, HeadObservation, Witness
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_fusion.mass_vector import Combined, MassVector
from deixis_fusion.poi_edits import PoiEdits
from deixis_fusion.reasons import explain
from deixis_fusion.registry import Registry
from deixis_fusion.report import PersonReport, Rows, TargetReport
from deixis_fusion.state import Asked, Standing, state_of
from deixis_fusion.visibility import Candidate
from deixis_runtime.queries import Refused
from deixis_schemas import codec, topics
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import (
    MAX_PERSONS,
    MAX_POIS,
    Belief,
    CameraInfo,
    FrameId,
    Gestures,
    HeadPoses,
    OfFrame,
    Poi,
    Producer,
    State,
    Target,
    Tracks,
)

PRODUCER = Producer("fusion", "test")
LIMIT = 1 << 20
K = (560.0, 0.0, 319.5, 0.0, 560.0, 239.5, 0.0, 0.0, 1.0)
INFO = {"stamp_ns": 0, "stage": "camera", "instance": "c", "state": "streaming", "source": "", "width": 640, "height": 480}


def many(count: int = MAX_POIS, name: str = "n" * 200) -> list[Poi]:
    """POIs in a circle about the person, with ids as long as they may be."""
    return [
        Poi(
            poi_id=f"{i:04}".ljust(64, "x"),
            name=name,
            position_m=(2 + 2 * math.cos(6.2832 * i / count), 2 * math.sin(6.2832 * i / count), 1.3),
        )
        for i in range(count)
    ]


def core(pois: list[Poi], **config: Any) -> Fusion:
    fusion = Fusion(FusionConfig.model_validate({"episodes": {"min_stroke_s": 0}} | config), PRODUCER)
    fusion.set_camera(CameraInfo.model_validate(INFO | {"camera_matrix": K}))
    fusion.set_pois(pois)
    return fusion


def point(
    fusion: Fusion, persons: int, frames: int = 2, run: int = 1, hand: dict[str, Any] | None = None
) -> tuple[list[Belief], list[Target]]:
    """So many persons in one place point to their left for so many frames, or do with the `hand` what is said."""
    beliefs, targets = [], []
    width = 280 * FACE_WIDTH_M
    for seq in range(frames):
        about: dict[str, Any] = {"run": run, "seq": seq, "stamp_ns": 10**12 + seq * 33_333_333, "instance": "i" * 60}
        face = {"kind": "face", "kind_probabilities": {"face": 1}, "centroid_px": (320, 240), "velocity_px_s": (0, 0)}
        faces = [face | {"track_id": n, "person_id": n, "bbox_px": (320 - width / 2, 215, width, 60)} for n in range(persons)]
        hand = hand or {"phase": "stroke", "gesture": "point_left", "bearing_deg": 60, "bearing_sigma_deg": 10}
        pose = {"status": "out_of_range", "side": "left"}
        belief, told = fusion.answer(
            JoinedFrame(
                Tracks.model_validate(about | {"stage": "tracker", "width": 640, "height": 480, "tracks": faces}),
                HeadPoses.model_validate(
                    about | {"stage": "headpose", "poses": [pose | {"person_id": n} for n in range(persons)]}
                ),
                Gestures.model_validate(
                    about | {"stage": "gesture", "gestures": [hand | {"person_id": n} for n in range(persons)]}
                ),
            ),
            {},
            None,
        )
        beliefs.append(belief)
        targets += told
    return beliefs, targets


def test_a_poi_with_the_longest_name_does_not_end_the_stage_when_it_is_pointed_at() -> None:
    fusion = core(many(3, "n" * 2000))
    point(fusion, 1)
    (final,) = fusion.end(None)
    assert "n" * 59 + "\N{HORIZONTAL ELLIPSIS}" in final.reason
    assert len(final.reason) < 500


@pytest.mark.parametrize("rules", ["paper", "deixis"])
def test_belief_and_target_stay_below_a_mebibyte_with_all_pois_and_all_persons(rules: str) -> None:
    fusion = core(many(), rules=rules, answer={"rows": 64, "max_ties": 64, "tie_ratio": 1e-6})
    beliefs, targets = point(fusion, MAX_PERSONS)
    targets += fusion.end(None)
    assert len(beliefs[-1].persons) == MAX_PERSONS
    assert max(len(codec.encode(belief)) for belief in beliefs) < LIMIT
    assert max(len(codec.encode(target)) for target in targets) < LIMIT
    assert all(len(target.reason) <= 2000 for target in targets)


@pytest.mark.parametrize("rules", ["paper", "deixis"])
def test_a_belief_is_small_where_nobody_points_or_nobody_is_there(rules: str) -> None:
    fusion = core(many(10_000), rules=rules)
    (*_, resting), told = point(fusion, 1, hand={"phase": "idle", "gesture": "none"})
    assert (len(resting.persons[0].pois), resting.persons[0].pois_total, told) == (16, 10_000, [])
    assert len(codec.encode(resting)) < 1 << 14  # ids as long as they may be
    (*_, alone), _ = point(fusion, 0, run=2)
    assert len(codec.encode(alone)) < 300


def test_in_paper_mode_the_robot_must_see_a_poi_as_well() -> None:
    behind = [Poi(poi_id="seen", position_m=(2, -2, 1.3)), Poi(poi_id="hidden", position_m=(2, 2, 1.3))]
    for rules, seen in (("paper", {"seen"}), ("deixis", {"seen", "hidden"})):
        fusion = core(behind, rules=rules)
        fusion.set_walls([((0.3, 0.1), (0.3, 3.0))])
        (*_, belief), _ = point(fusion, 1)
        assert {row.poi_id for row in belief.persons[0].pois} == seen


def candidates(count: int) -> list[Candidate]:
    return [Candidate(poi, 0.0, 1.0) for poi in many(count)]


def largest(observed: str) -> Assessment:
    """All sets large, all POIs named, every text as long as it comes."""
    seen = candidates(MAX_POIS)
    all_but_one = [(np.arange(MAX_POIS) != i, 1.0) for i in range(16)]
    sets, chances = MassVector.normalised(np.zeros(MAX_POIS), all_but_one), np.full(MAX_POIS, 1 / MAX_POIS)
    said = Witness("ok", observed, "p" * 129)
    judgement = Judgement(seen, sets, sets, Combined(sets, 0.9), chances, Choice(tuple(range(MAX_POIS))))
    return Assessment(None, Evidence(HandObservation("invisible"), said, HeadObservation(None), said), judgement, (), "d" * 300)


def test_the_largest_answer_that_rules_can_give_stays_below_a_mebibyte() -> None:
    frame = OfFrame(run=1, seq=1, stamp_ns=1, stage="fusion", instance="i" * 64)
    target = TargetReport(frame, 2**62, "e" * 80, 1, 2, True, largest("o" * 5000), None).message(Rows(64))
    assert len(codec.encode(target)) < LIMIT / 4
    assert (len(target.poi_ids), len(target.evidence[0].observed)) == (MAX_POIS, 2000)


def test_the_largest_belief_that_rules_can_give_stays_below_a_mebibyte() -> None:
    # A stage's refusal is quoted with 500 characters of its error.
    reports = [PersonReport(n, largest("o" * 550), "e" * 80, None) for n in range(MAX_PERSONS)]
    frame = OfFrame(run=1, seq=1, stamp_ns=1, stage="fusion", instance="i" * 64)
    belief = Belief.derive(frame, PRODUCER, persons=[report.message(Rows(64)) for report in reports])
    assert len(codec.encode(belief)) < LIMIT


def test_messages_hold_the_likeliest_pois_best_first_and_say_how_many_there_were() -> None:
    fusion = core(many(100))
    beliefs, _ = point(fusion, 1)
    (final,) = fusion.end(None)
    for told in (beliefs[-1].persons[0], final):
        assert (len(told.pois), told.pois_total) == (16, 100)
        chances = [row.probability or 0 for row in told.pois]
        assert chances == sorted(chances, reverse=True)
        assert chances[0] > 1 / 100


def test_an_unplaced_persons_rows_are_bounded_too() -> None:
    fusion = core(many(100))
    fusion.set_camera(CameraInfo.model_validate(INFO))
    beliefs, _ = point(fusion, 1)
    (person,) = beliefs[-1].persons
    assert (len(person.pois), person.pois_total, person.pois[0].pignistic) == (16, 100, pytest.approx(0.01))


def test_a_set_tells_its_size_and_its_first_members() -> None:
    fusion = core(many(100))
    beliefs, _ = point(fusion, 1)
    everything = [focal for focal in beliefs[-1].persons[0].evidence[0].masses if focal.size == 100]
    assert len(everything[0].poi_ids) == 16


def test_an_abstention_is_explained_whatever_abstains() -> None:
    seen, nothing = candidates(2), MassVector.vacuous(2)
    choice = Choice((), "why " * 2000)
    said = Witness("ok", "")
    judgement = Judgement(seen, nothing, nothing, Combined(nothing, 0.0), np.full(2, 0.5), choice)
    assert len(explain(Assessment(None, Evidence(None, said, None, said), judgement, ()))) == 2000


# --- State ------------------------------------------------------------------------------------------------------------


class Desk:
    """A core and a registry whose state is asked for."""

    def __init__(self, path: Path, pois: list[Poi]) -> None:
        self.registry = Registry(path)
        self.registry.apply_site(pois)
        self.edits = PoiEdits(self.registry, "deixis/r1/fusion/poi/", lambda _id, _poi: None)
        self.fusion = core(self.registry.pois())

    def state(self, **parameters: str) -> State:
        asked = Asked.by(parameters, self.registry, 16)
        standing = Standing(PRODUCER, "r1", 1, FrameId(1, 5), [], 7)
        return state_of(asked, standing, self.fusion, self.registry, self.edits)


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Desk:
    """1024 POIs with names of 200 characters, 16 answers and three persons."""
    desk = Desk(tmp_path_factory.mktemp("full") / "pois.sqlite", many())
    for run in range(16):
        point(desk.fusion, 1, run=run)
    point(desk.fusion, 3, run=99)
    return desk


def test_the_state_of_a_full_registry_is_within_its_topics_limit(full: Desk) -> None:
    state = full.state()
    assert len(codec.encode_json(state)) < topics.STATE.max_bytes / 4
    assert (len(state.pois), state.pois_total, len(state.recent_targets), len(state.persons)) == (16, MAX_POIS, 16, 3)
    assert {len(target.pois) for target in state.recent_targets} == {16}
    assert (state.edits_lost, state.run, state.last_seq) == (7, 1, 5)


def test_top_asks_for_more_of_each_list(full: Desk) -> None:
    state = full.state(top="100")
    assert len(state.pois) == 100
    assert {len(told.pois) for told in [*state.persons, *state.recent_targets]} == {100}


def test_poi_asks_for_one_pois_rows_and_entry(full: Desk) -> None:
    wanted = full.registry.pois()[700].poi_id
    state = full.state(poi=wanted)
    assert [poi.poi_id for poi in state.pois] == [wanted]
    assert {row.poi_id for told in [*state.persons, *state.recent_targets] for row in told.pois} == {wanted}
    assert state.persons[0].pois_total == MAX_POIS


def test_state_and_target_tell_whom_a_wall_hides_and_a_belief_is_kept_short() -> None:
    fusion = core(many(40))
    fusion.set_walls([((2.0, -1.0), (-9.0, -1.0)), ((2.0, -1.0), (9.0, -1.0))])
    beliefs, _ = point(fusion, 1)
    (final,) = fusion.end(None)
    assert beliefs[-1].persons[0].excluded == []
    assert (len(final.excluded), final.excluded_total, final.pois_total) == (13, 13, 27)
    assert {told.reason for told in final.excluded} == {"behind a wall"}
    assert "; behind a wall: 'n" in final.reason
    assert " and 10 more" in final.reason


def test_state_tells_of_the_poi_asked_for_that_it_is_behind_a_wall(tmp_path: Path) -> None:
    desk = Desk(tmp_path / "pois.sqlite", many(40))
    desk.fusion.set_walls([((2.0, -1.0), (-9.0, -1.0)), ((2.0, -1.0), (9.0, -1.0))])
    point(desk.fusion, 1)
    pois = desk.registry.pois()
    hidden, seen = (poi.poi_id for poi in (pois[30], pois[10]))
    (person,) = desk.state(poi=hidden).persons
    assert ([told.poi_id for told in person.excluded], person.excluded_total) == ([hidden], 13)
    (person,) = desk.state(poi=seen).persons
    assert (person.excluded, [row.poi_id for row in person.pois]) == ([], [seen])


def test_state_says_why_in_words_of_each_person_and_a_belief_does_not(tmp_path: Path) -> None:
    desk = Desk(tmp_path / "pois.sqlite", many(40))
    beliefs, _ = point(desk.fusion, 1)
    (person,) = desk.state().persons
    assert person.reason.startswith(
        "The person points to the left with a hand (about 60 +- 10 deg) and the head is turned far left"
    )
    assert beliefs[-1].persons[0].reason == ""


def test_person_asks_for_one_person(full: Desk) -> None:
    state = full.state(person="2")
    assert [person.person_id for person in state.persons] == [2]
    assert state.recent_targets == []
    assert full.state(person="77").persons == []


@pytest.mark.parametrize(
    ("parameters", "complaint"),
    [
        ({"top": "0"}, r"^top: '0'"),
        ({"top": "1025"}, r"^top: '1025'"),
        ({"top": "many"}, r"^top: 'many'"),
        ({"top": "\N{SUPERSCRIPT TWO}"}, "^top: "),
        ({"top": ""}, r"^top: ''"),
        ({"poi": "ghost"}, r"^poi: there is no POI 'ghost'"),
        ({"poi": ""}, "^poi: "),
        ({"person": "-1"}, r"^person: '-1'"),
        ({"persons": "1"}, "^persons: unknown parameter; there are top, poi, person, format"),
        ({"person": "9" * 400}, "^person: "),
        ({"poi": "a\x1b[2J"}, r"^poi: there is no POI 'a<U\+001B>\[2J'"),
        ({"top": "\n9"}, r"^top: '<U\+000A>9'"),
        ({"per\x1bson": "1"}, r"^per<U\+001B>son: unknown"),
    ],
)
def test_a_parameter_that_cannot_be_is_refused_with_its_name(full: Desk, parameters: dict[str, str], complaint: str) -> None:
    with pytest.raises(Refused, match=complaint):
        full.state(**parameters)


def test_the_largest_state_by_default_is_a_small_part_of_what_the_topic_allows(full: Desk) -> None:
    assert len(codec.encode_json(full.state())) < topics.STATE.max_bytes / 4
