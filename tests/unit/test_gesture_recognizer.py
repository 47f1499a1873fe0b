"""The core on drawn persons: one gesture a person, steady, deterministic, robust to bad tracks."""

import math

import cv2
import numpy as np
import pytest
from deixis_gesture.arm import Arm
from deixis_gesture.bearing import HandSight
from deixis_gesture.config import GestureConfig
from deixis_gesture.hand import Face
from deixis_gesture.person import View
from deixis_gesture.recognizer import GestureRecognizer
from deixis_runtime.lens import Lens
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import CameraMount, Gestures, KindProbabilities, Producer, Track, Tracks
from pydantic import ValidationError

LENS = Lens(640, 480, (560.0, 560.0, 319.5, 239.5))
FACE_PX = 50.0
UP_S, HELD_S, DOWN_S, REST_S = 1.0, 1.5, 3.0, 3.5
POINT = (180,)
OPEN = (-30, -60, -90, -120)


def _track(track_id, person_id, kind, centre, size, contour=b"", **more):
    box = (centre[0] - size[0] / 2, centre[1] - size[1] / 2, *size)
    return Track(
        track_id=track_id,
        person_id=person_id,
        kind=kind,
        kind_probabilities=KindProbabilities(**{kind: 1.0}),
        centroid_px=centre,
        bbox_px=box,
        velocity_px_s=(0.0, 0.0),
        contour=contour,
        **more,
    )


def _face(person_id=0, x=320.0):
    return _track(10 * person_id, person_id, "face", (x, 150.0), (FACE_PX, 1.3 * FACE_PX))


def _hand(place, fingers, person_id=0, x=320.0, track_id=None, kind="right_hand", **more):
    """A hand at `place` face widths from the face, with fingers in these directions (degrees, x toward y down)."""
    canvas = np.zeros((480, 640), np.uint8)
    centre = np.array([x, 150.0]) + FACE_PX * np.array(place)
    cv2.circle(canvas, [round(float(v)) for v in centre], round(0.27 * FACE_PX), 1, -1)
    for degrees in fingers:
        tip = centre + 0.75 * FACE_PX * np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
        cv2.line(canvas, [round(float(v)) for v in centre], [round(float(v)) for v in tip], 1, round(0.14 * FACE_PX))
    outlines, _ = cv2.findContours(canvas, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = max(outlines, key=len)[:, 0, :].astype("<i2").tobytes() if outlines else b""
    identity = 10 * person_id + 1 if track_id is None else track_id
    return _track(identity, person_id, kind, (float(centre[0]), float(centre[1])), (30.0, 30.0), contour, **more)


def _place(time_s, held=(-3.4, 1.0), rest=(-1.2, 4.3)):
    share = min(1.0, max(0.0, (time_s - UP_S) / (HELD_S - UP_S))) - min(1.0, max(0.0, (time_s - DOWN_S) / (REST_S - DOWN_S)))
    return rest[0] + share * (held[0] - rest[0]), rest[1] + share * (held[1] - rest[1])


def _steady(time_s):
    return 10**18 + round(time_s * 1e9)


def _played(tracks_at, rate_hz=30, seconds=4.2, recognizer=None, run=1, stamp_ns=_steady):
    recognizer = recognizer or GestureRecognizer(GestureConfig())
    times = [i / rate_hz for i in range(int(seconds * rate_hz))]
    return [(t, recognizer.update(tracks_at(t), 640, 480, LENS, run, stamp_ns(t))) for t in times]


def _turning(tracks_at, speed_px_s):
    """The same, seen by a camera that turns: everything moves to the right."""
    recognizer, seen = GestureRecognizer(GestureConfig()), []
    for time_s in (i / 30 for i in range(126)):
        dx = speed_px_s * time_s
        tracks = [_shifted(track, dx) for track in tracks_at(time_s)]
        seen.append((time_s, recognizer.update(tracks, 640, 480, LENS, 1, _steady(time_s), (dx, 0.0))))
    return seen


def _shifted(track, dx):
    (x, y), (left, top, w, h) = track.centroid_px, track.bbox_px
    contour = np.frombuffer(track.contour, "<i2").reshape(-1, 2) + np.array([round(dx), 0])
    moved = {"centroid_px": (x + dx, y), "bbox_px": (left + dx, top, w, h), "contour": contour.astype("<i2").tobytes()}
    return track.model_copy(update=moved)


def _pointing(time_s):
    return [_face(), _hand(_place(time_s), POINT)]


def _settled(answers):
    return [gestures[0] for t, gestures in answers if HELD_S + 0.5 < t < DOWN_S]


@pytest.mark.parametrize("rate_hz", [10, 15, 30])
def test_a_pointing_is_named_with_side_hand_tip_and_bearing(rate_hz):
    for gesture in _settled(_played(_pointing, rate_hz)):
        assert (gesture.phase, gesture.gesture, gesture.hand) == ("stroke", "point_right", "right")
        assert gesture.fingertips_px[0] == pytest.approx((320 - 4.15 * FACE_PX, 150 + FACE_PX), abs=6)
        assert gesture.bearing_deg is not None
        assert -90 < gesture.bearing_deg < -30


def test_before_and_after_the_stroke_nothing_is_pointed_at():
    outside = [gestures[0] for t, gestures in _played(_pointing) if t < HELD_S - 0.1 or t > DOWN_S + 0.2]
    assert {gesture.gesture for gesture in outside} == {"none"}
    assert _played(_pointing)[-1][1][0].phase == "idle"


def test_an_open_hand_is_other():
    answers = _played(lambda t: [_face(), _hand(_place(t, held=(-1.8, 0.2)), OPEN)])
    assert {g.gesture for g in _settled(answers)} == {"other"}
    assert all(g.bearing_deg is None for g in _settled(answers))


def test_a_held_hands_posture_is_told_and_a_moving_hands_is_not():
    told = {gesture.phase: set() for _, (gesture,) in _played(_pointing)}
    for _, (gesture,) in _played(_pointing):
        told[gesture.phase].add(gesture.hand_posture)
    assert told.pop("stroke") - {None} == {"index"}
    assert set.union(*told.values()) == {None}
    opened = _settled(_played(lambda t: [_face(), _hand(_place(t, held=(-1.8, 0.2)), OPEN)]))
    assert "index" not in {gesture.hand_posture for gesture in opened}
    assert all(gesture.hand_posture_probability > 0.2 for gesture in opened)


def test_a_fist_held_toward_the_camera_is_invisible():
    assert {g.gesture for g in _settled(_played(lambda t: [_face(), _hand(_place(t, held=(-1.9, 0.9)), ())]))} == {"invisible"}


def test_a_fist_that_was_there_when_the_person_came_is_no_pointing():
    gestures = [answers[0].gesture for _, answers in _played(lambda _: [_face(), _hand((-1.9, 0.9), ())])]
    assert set(gestures) <= {"none", "other"}


def test_two_hands_held_up_together_are_no_pointing():
    def both(time_s, second):
        return [_face(), _hand(_place(time_s), POINT), _hand(second, (), track_id=2, kind="left_hand")]

    def joined(time_s):
        x, y = _place(time_s)
        return both(time_s, (x + 1.5, y))

    assert {g.gesture for g in _settled(_played(joined))} == {"other"}
    assert {g.gesture for g in _settled(_played(lambda t: both(t, (1.2, 4.3))))} == {"point_right"}


def test_two_runs_on_the_same_tracks_are_equal():
    assert _played(_pointing) == _played(_pointing)


def test_a_hand_missed_now_and_then_and_renamed_stays_in_its_stroke():
    def patchy(time_s):
        step = round(time_s * 30)
        hand = _hand(_place(time_s), POINT, track_id=1 if time_s < 2.2 else 7)
        return [_face()] if step % 5 in (1, 2) else [_face(), hand]

    assert {(g.phase, g.gesture) for g in _settled(_played(patchy))} == {("stroke", "point_right")}


def test_a_hand_lost_for_good_ends_its_stroke():
    answers = _played(lambda t: _pointing(t) if t < 2.2 else [_face()])
    assert answers[-1][1][0].phase == "idle"


def test_predicted_and_empty_hands_say_nothing():
    answers = _played(lambda t: [_face(), _track(1, 0, "right_hand", (150.0, 200.0), (30.0, 30.0), observed=t < 1)])
    assert {g[0].phase for _, g in answers} == {"idle"}


def test_every_person_with_a_face_has_one_gesture_and_nobody_else():
    def two(time_s):
        own = [_face(0, 200.0), _hand((-1.2, 4.3), (), x=200.0), _face(1, 450.0)]
        loose = _hand(_place(time_s), POINT, person_id=5, x=450.0)
        pointing = _hand(_place(time_s, held=(3.2, 1.0), rest=(1.2, 4.3)), (0,), 1, 450.0, kind="left_hand")
        return [*own, pointing, loose, loose.model_copy(update={"person_id": None, "track_id": 99})]

    for time_s, gestures in _played(two):
        assert [g.person_id for g in gestures] == [0, 1]
        if HELD_S + 0.5 < time_s < DOWN_S:
            assert [g.gesture for g in gestures] == ["none", "point_left"]


def test_another_run_of_the_camera_starts_anew():
    recognizer = GestureRecognizer(GestureConfig())
    first = _played(_pointing, seconds=2.5, recognizer=recognizer)  # ends in a stroke
    assert _played(_pointing, seconds=2.5, recognizer=recognizer, run=2) == first


@pytest.mark.parametrize("set_back_at_s", [1.3, 1.6, 2.2])
def test_a_clock_set_back_by_40_ms_does_not_lose_a_stroke(set_back_at_s):
    set_back = _played(_pointing, stamp_ns=lambda t: _steady(t) - (40_000_000 if t >= set_back_at_s else 0))
    assert [g.phase for _, (g,) in set_back] == [g.phase for _, (g,) in _played(_pointing)]
    assert {(g.phase, g.gesture) for g in _settled(set_back)} == {("stroke", "point_right")}


def test_a_frame_of_twice_the_size_through_the_same_lens_gives_the_same_gestures():
    def twice(track):
        x, y, w, h = track.bbox_px
        outline = (2 * np.frombuffer(track.contour, "<i2")).astype("<i2").tobytes()
        place = (2 * track.centroid_px[0], 2 * track.centroid_px[1])
        return track.model_copy(update={"bbox_px": (2 * x, 2 * y, 2 * w, 2 * h), "centroid_px": place, "contour": outline})

    large = GestureRecognizer(GestureConfig())
    for time_s, (small,) in _played(_pointing):
        tracks = [twice(track) for track in _pointing(time_s)]
        (seen,) = large.update(tracks, 1280, 960, LENS, 1, _steady(time_s))
        assert (seen.phase, seen.gesture, seen.hand) == (small.phase, small.gesture, small.hand)
        assert seen.bearing_deg == pytest.approx(small.bearing_deg, abs=1.0)


@pytest.mark.parametrize("focal_px", [300.0, 560.0, 1200.0])
def test_a_persons_distance_follows_from_the_lens(focal_px):
    view = View(Lens(640, 480, (focal_px, focal_px, 319.5, 239.5)), (640, 480), CameraMount())
    face = Face(320.0, 150.0, focal_px * FACE_WIDTH_M / 2.0)
    arm = view.arm_of(face, HandSight((0.0, 0.0), (0.0, 0.0), 0.3))
    assert math.hypot(arm.distance, arm.height) == pytest.approx(2.0 / FACE_WIDTH_M)


def test_a_hand_that_is_held_still_is_still_for_a_camera_that_turns():
    still, turning = ([g.phase for _, (g,) in seen] for seen in (_played(_pointing), _turning(_pointing, 120.0)))
    assert still.count("stroke") > 30
    assert sum(a != b for a, b in zip(still, turning, strict=True)) <= 4


def test_a_hand_whose_fingers_come_and_go_in_its_outline_is_held_still():
    arm, face, phases = Arm(GestureConfig(), 0.0), Face(320.0, 150.0, FACE_PX), []
    for i in range(40):
        arm.update(_hand((-3.2, 1.0), OPEN if i % 6 < 3 else ()), face, (0.0, 0.0), i / 30, 1 / 30)
        phases.append(arm.phase)
    assert set(phases[10:]) == {"stroke"}


@pytest.mark.parametrize("x", [60.0, 560.0])
def test_a_hand_at_rest_is_at_rest_wherever_in_the_picture_while_the_faces_width_is_measured_better(x):
    arm, phases = Arm(GestureConfig(), 0.0), []
    for i in range(45):
        face = Face(x, 150.0, FACE_PX * (1 + 0.1 * math.exp(-i / 20)))
        arm.update(_hand((0.4, 4.3), (), x=x), face, (0.0, 0.0), i / 30, 1 / 30)
        phases.append(arm.phase)
    assert set(phases[2:]) == {"idle"}


@pytest.mark.parametrize("rate_hz", [10, 30, 60])
def test_a_hand_changes_its_side_as_fast_at_any_frame_rate(rate_hz):
    arm, face, changed_s = Arm(GestureConfig(), 0.0), Face(320.0, 150.0, FACE_PX), None
    for i in range(3 * rate_hz):
        time_s = i / rate_hz
        hand = _hand((2.0, 4.0), (), kind="left_hand" if time_s < 1 else "right_hand")
        arm.update(hand, face, (0.0, 0.0), time_s, 1 / rate_hz)
        changed_s = time_s if arm.side == "right" and changed_s is None else changed_s
    assert changed_s == pytest.approx(1.14, abs=0.12)


@pytest.mark.parametrize("rate_hz", [10, 30])
def test_the_bearing_is_that_of_the_last_half_second_at_any_frame_rate(rate_hz):
    arm, face = Arm(GestureConfig(), 0.0), Face(320.0, 150.0, FACE_PX)
    for i in range(2 * rate_hz + 1):
        time_s = i / rate_hz
        place = (-3.4 if time_s < 1.6 else -3.2, 1.0)
        arm.update(_hand(place, POINT), face, (0.0, 0.0), time_s, 1 / rate_hz)
    assert arm.phase == "stroke"
    assert arm.sight is not None
    assert arm.sight.tip[0] == pytest.approx(-3.95, abs=0.1)


def test_a_face_too_small_to_measure_by_gives_no_gesture():
    tiny = _track(0, 0, "face", (320.0, 150.0), (2.0, 2.0))
    assert GestureRecognizer(GestureConfig()).update([tiny], 640, 480, LENS, 1, 1) == []


def test_an_empty_frame_is_refused_by_name():
    with pytest.raises(ValueError, match="width, height: 0 x 480"):
        GestureRecognizer(GestureConfig()).update([], 0, 480, LENS, 1, 1)


def test_an_unknown_setting_is_refused():
    with pytest.raises(ValidationError, match="stil_speed"):
        GestureConfig.model_validate({"stil_speed": 1})


def test_answers_fit_the_message():
    tracks = Tracks(run=1, seq=3, stamp_ns=10**18, stage="tracker", instance="t", width=640, height=480, tracks=_pointing(2.0))
    gestures = GestureRecognizer(GestureConfig()).update(tracks.tracks, 640, 480, LENS, tracks.run, tracks.stamp_ns)
    assert Gestures.derive(tracks, Producer("gesture", "g"), gestures=gestures).frame_id == tracks.frame_id
