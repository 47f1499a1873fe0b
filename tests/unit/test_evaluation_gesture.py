"""Scores of the gesture stage: strokes found and missed, false pointings, and table 1 as measured."""

import math

import pytest
from deixis_cli.options import CommandError
from deixis_evaluation.clips import Truth
from deixis_evaluation.gesture_scores import GestureScore, StrokeScore, score_gestures
from deixis_evaluation.gesture_summary import summarise_gestures
from deixis_evaluation.hand_confusion import count_gestures, hand_confusion, write_confusion
from deixis_evaluation.recording import Recording
from deixis_fusion.confusion import HandConfusion, load_table
from deixis_schemas.messages import BEARING_STEP_DEG, BEARINGS, Gesture, Gestures

FPS = 30
STROKE = range(20, 50)
HAND = {"center_px": (200.0, 200.0), "visible_px": 300, "in_frame": True, "centroid_visible_px": (200.0, 200.0)}


def _truth(azimuth=60.0, frames=90, stroke=STROKE, head_m=None):
    return Truth.model_validate(
        {
            "meta": {
                "kind": "point", "fps": FPS, "width": 640, "height": 480,
                "camera": {"R_world_to_cam": [1, 0, 0, 0, -1, 0, 0, 0, -1], "t_world_to_cam": (0, 0, 0),
                           "K": ((560, 0, 320), (0, 560, 240), (0, 0, 1))},
                "pois": [{"id": "P1", "xyz_world": (1, 1, 1)}],
            },
            "frames": [{"frame": i, "persons": [_person(azimuth, i in stroke, head_m)]} for i in range(frames)],
        }
    )  # fmt: skip


def _person(azimuth, points, head_m):
    return {
        "id": 0, "phase": "stroke" if points else "none", "gesture": "point" if points else "none",
        "poi": "P1" if points else None, "poi_azimuth_deg": azimuth if points else None,
        "head": {"yaw_rel_deg": 0.0, "center_px": (320.0, 100.0), "center_cam": head_m}, "face": {"visible_px": 900},
        "hands": {"left": HAND, "right": HAND}, "arm": {"side": "left"} if points else {},
        "user_pos": {"robot_xy": (2.0, 0.0), "distance_m": 2.0},
    }  # fmt: skip


def _curve(bearing):
    values = [0.01] * BEARINGS
    values[round((bearing + 180) / BEARING_STEP_DEG)] = 1.0
    return values


def _said(frames, gesture="point_left", bearing=60.0, phase="stroke", **more):
    """A recording in which this is said in these frames of the person tracked as 7."""
    recording = Recording()
    for frame in frames:
        told = {"bearing_deg": bearing, "bearing_sigma_deg": 9.0, "bearing_likelihood": _curve(bearing), **more}
        one = Gesture(person_id=7, phase=phase, gesture=gesture, **(told if gesture != "other" else {}))
        of = {"run": 1, "seq": frame, "stamp_ns": frame, "stage": "gesture", "instance": "g"}
        recording.add(Gestures(**of, gestures=[one]), frame)
    return recording


def _scored(recording, **truth):
    return score_gestures("clip", _truth(**truth), recording, {7: 0})


def test_an_elevation_is_off_from_that_of_the_poi_at_the_head():
    """The POI is at (1, 1, 1); a head 2 m before the camera and level with it has it 1 m up and sqrt(1 + 9) m away."""
    said = _said(range(23, 52), elevation_deg=20.0, elevation_sigma_deg=9.0)
    (stroke,) = _scored(said, head_m=(0.0, 0.0, 2.0)).strokes
    assert stroke.elevation_off_deg == pytest.approx(20.0 - math.degrees(math.atan2(1, math.sqrt(10))))
    assert stroke.elevation_sigma_deg == 9.0
    assert _scored(said).strokes[0].elevation_off_deg is None
    assert summarise_gestures([_scored(said, head_m=(0.0, 0.0, 2.0))]).elevation_within_1.share == 1.0


def test_a_stroke_that_is_said_is_recognised_with_side_bearing_and_times():
    (stroke,) = _scored(_said(range(23, 52))).strokes
    assert (stroke.said, stroke.side) == ("point_left", "left")
    assert stroke.bearing_off_deg == pytest.approx(0.0)
    assert stroke.level == pytest.approx(0.0)
    assert stroke.onset_s == pytest.approx(3 / FPS)
    assert stroke.end_s == pytest.approx(2 / FPS)


def test_a_stroke_said_in_a_few_frames_or_as_something_else_is_missed():
    assert _scored(_said(range(44, 49))).strokes[0].said == "missed"
    assert _scored(_said(STROKE, "other")).strokes[0].said == "missed"


def test_the_wrong_side_and_a_wrong_bearing_count():
    score = _scored(_said(STROKE, "point_right", bearing=-40.0))
    summary = summarise_gestures([score])
    assert summary.side.share == 0.0
    assert summary.bearing_off_deg == pytest.approx(100.0)
    assert summary.within_95.share in (0.0, 1.0)


def test_a_pointing_that_is_said_of_nobody_who_points_is_false():
    score = _scored(_said([*range(5), *range(70, 90)]), stroke=range(30, 40))
    assert [(one.first, one.last) for one in score.false] == [(0, 4), (70, 89)]


def test_what_is_said_just_before_and_after_a_stroke_belongs_to_it():
    assert _scored(_said(range(10, 60))).false == ()


def test_false_pointings_are_counted_by_the_minute_of_quiet_clips_alone():
    quiet = _scored(_said(range(30)), stroke=range(0))
    loud = _scored(_said([*STROKE, *range(80, 90)]))
    summary = summarise_gestures([quiet, loud])
    assert summary.false == 2
    assert summary.false_per_quiet_minute == pytest.approx(60 * FPS / 90)


def _strokes(**said):
    return [
        StrokeScore("c", 0, {"left": 60.0, "center": 5.0, "right": -60.0}[region], "left", None, 30, gesture)
        for gesture, regions in said.items()
        for region, count in regions.items()
        for _ in range(count)
    ]


def test_table_1_as_measured_is_what_fusion_reads(tmp_path):
    strokes = _strokes(
        point_left={"left": 8}, invisible={"center": 5, "left": 1}, point_right={"right": 9, "center": 1}, missed={"left": 4}
    )
    write_confusion(tmp_path / "table.json", strokes, "a test")
    table = load_table(tmp_path / "table.json", HandConfusion)
    assert table.share("point_left", "left") == pytest.approx(8.5 / 10.5)
    assert table.share("invisible", "center") == pytest.approx(5.5 / 7.5)
    assert 0 < table.share("point_right", "left") < 0.1


def test_a_region_without_a_recognised_stroke_is_refused_by_name():
    strokes = _strokes(point_left={"left": 3}, missed={"right": 3})
    with pytest.raises(CommandError, match="center or right"):
        hand_confusion(count_gestures(strokes, (40, 140)), "a test")


def test_a_clip_that_was_not_played_counts_nowhere():
    assert summarise_gestures([GestureScore("c", "point", 3.0, failure="no video")]).quiet_minutes == 0
