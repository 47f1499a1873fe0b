"""Scores of fusion alone: whose fault a wrong answer is, rings of POIs, and whether stated chances are true."""

import math
from pathlib import Path

import pytest
from deixis_evaluation.clips import Clip, Truth
from deixis_evaluation.episode_scores import EpisodeScore, strokes_of
from deixis_evaluation.fusion_play import VARIANTS, FusionScore, GapAnswer, ring_of
from deixis_evaluation.fusion_summary import calibration_error, faults, figures, luck, named_at, outcomes, reliability


def _episode(outcome):
    return EpisodeScore(0, "P1", 40.0, (0, 9), outcome, True, ("P1",), None, None, "", None, {}, None, 0.0, {}, None)


def _clip_of(*strokes, gaps=()):
    """Each stroke: its outcome as the stages said, with the true yaw, the true hand, both."""
    return FusionScore(
        "clip",
        "point",
        {variant: tuple(_episode(row[i]) for row in strokes) for i, variant in enumerate(VARIANTS)},
        dict.fromkeys(VARIANTS, 1),
        tuple(gaps),
    )


def test_a_stroke_that_is_not_named_is_the_fault_of_what_would_have_named_it():
    named, missed, wrong = "named", "missed", "wrong"
    score = _clip_of(
        (named, missed, missed, missed),
        (missed, named, missed, missed),
        (wrong, missed, named, named),
        (wrong, named, named, named),
        (missed, missed, missed, named),
        (missed, missed, missed, wrong),
    )
    assert faults([score]) == {"head": 1, "hand": 1, "either": 1, "both together": 1, "neither": 1}
    assert outcomes([score], "as they are") == {"named": 1, "missed": 3, "wrong": 2}
    assert figures([score])["false_episodes"]["true yaw"] == 1


def test_a_clip_that_was_not_played_counts_nowhere():
    assert figures([FusionScore("c", "point", failure="no video")])["ece"] is None


def test_chances_that_are_true_have_no_calibration_error():
    answers = [GapAnswer(30, "named", 0.75, number < 3) for number in range(4)]
    answers += [GapAnswer(30, "wrong", 0.5, number < 1) for number in range(2)]
    assert calibration_error(reliability([_clip_of(gaps=answers)])) == pytest.approx(0.0)
    assert named_at([_clip_of(gaps=answers)], 30).share == pytest.approx(4 / 6)


def test_chances_that_are_too_high_show():
    answers = [GapAnswer(22, "wrong", 0.95, False) for _ in range(5)]
    (only,) = reliability([_clip_of(gaps=answers)])
    assert (only.stated, only.right.share) == (pytest.approx(0.95), 0.0)
    assert calibration_error([only]) == pytest.approx(0.95)


def test_the_masses_have_a_reliability_of_their_own():
    answers = [GapAnswer(22, "named", 0.95, True, i, (0.55, i == 0)) for i in range(2)]
    told = figures([_clip_of(gaps=answers)])
    assert told["ece"] == pytest.approx(0.05)
    assert told["reliability_of_masses"] == [{"stated": pytest.approx(0.55), "right": 0.5, "answers": 2}]
    assert told["ece_of_masses"] == pytest.approx(0.05)


def _stated(*chances, strokes):
    return [GapAnswer(30, "named", chance, True, i % strokes) for i, chance in enumerate(chances)]


def test_few_answers_have_a_calibration_error_by_luck_and_many_hardly_any():
    chances = [0.05 + 0.1 * i for i in range(10)]
    few, many = (luck([_clip_of(gaps=_stated(*chances * count, strokes=10 * count))]) for count in (4, 400))
    # Four answers a bin, of which a binomial number is right.
    off = [math.comb(4, k) * p**k * (1 - p) ** (4 - k) * abs(k / 4 - p) for p in chances for k in range(5)]
    assert few.mean == pytest.approx(sum(off) / 10, abs=0.003)
    assert many.mean < 0.02
    assert few.mean < few.most < 0.3
    assert luck([_clip_of(gaps=_stated(*chances * 4, strokes=40))]) == few
    assert luck([_clip_of()]) is None


def test_answers_of_one_stroke_have_the_luck_of_one():
    alone = luck([_clip_of(gaps=_stated(0.5, strokes=1))])
    assert luck([_clip_of(gaps=_stated(*[0.5] * 4, strokes=1))]) == alone == pytest.approx((0.5, 0.5))
    assert luck([_clip_of(gaps=_stated(*[0.5] * 4, strokes=4))]).mean < 0.3


def _truth():
    hand = {"center_px": (200.0, 200.0), "visible_px": 300, "in_frame": True}
    person = {
        "id": 0, "phase": "stroke", "gesture": "point", "poi": "P1", "poi_azimuth_deg": 30.0,
        "head": {"yaw_rel_deg": 0.0, "center_px": (320.0, 100.0)}, "face": {"visible_px": 900},
        "hands": {"left": hand, "right": hand}, "arm": {"side": "left"},
        "user_pos": {"robot_xy": (2.0, 0.0), "distance_m": 2.0},
    }  # fmt: skip
    camera = {"R_world_to_cam": [1, 0, 0, 0, -1, 0, 0, 0, -1], "t_world_to_cam": (0, 1.2, 0),
              "K": ((560, 0, 320), (0, 560, 240), (0, 0, 1))}  # fmt: skip
    meta = {"kind": "point", "fps": 30, "width": 640, "height": 480, "camera": camera,
            "pois": [{"id": "P1", "xyz_world": (1.5, 1.0, -1.0)}]}  # fmt: skip
    return Truth.model_validate({"meta": meta, "frames": [{"frame": 0, "persons": [person]}]})


@pytest.mark.parametrize("gap", [10, 15, 22, 30])
def test_a_ring_is_as_far_and_as_high_as_the_poi_meant_and_no_two_are_nearer_than_the_gap(gap):
    clip = Clip("c", Path("c.mp4"), _truth())
    pois = ring_of(clip, strokes_of(clip.truth)[0], gap)
    away = {poi.poi_id: (poi.position_m[0] - 2.0, poi.position_m[1]) for poi in pois}
    assert {round(math.hypot(x, y), 6) for x, y in away.values()} == {round(math.hypot(*away["P1"]), 6)}
    assert len({poi.position_m[2] for poi in pois}) == 1
    bearings = sorted(math.degrees(math.atan2(y, x)) for x, y in away.values())
    apart = [after - before for before, after in zip(bearings, [*bearings[1:], bearings[0] + 360], strict=True)]
    assert min(apart) > gap - 1e-6
    assert len(pois) == 360 // gap
