"""Fingers, arms, phases, and whole gestures of the guest, on hands made by hand."""

import math

import numpy as np
import pytest
from deixis_gesture_mediapipe.arm import BEARINGS, ArmSeen, bearing_of
from deixis_gesture_mediapipe.config import GestureConfig
from deixis_gesture_mediapipe.fingers import HandRead, pointing_deg, shape_of
from deixis_gesture_mediapipe.recognizer import GestureRecognizer
from deixis_runtime.lens import Lens
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import CameraMount, KindProbabilities, Track, Tracks

SIZE = (640, 480)
LENS = Lens(640, 480, (560.0, 560.0, 319.5, 239.5))
LEVEL = CameraMount()
DISTANCE_M = 2.2
FACE = (320.0, 150.0)
WIDTH = 560 * FACE_WIDTH_M / DISTANCE_M
FINGERS = {"index": (5, 0.02), "middle": (9, 0.0), "ring": (13, -0.02), "little": (17, -0.04)}


def read(*straight, along=(1.0, 0.0, 0.0), at=(0.0, 0.0)):
    """A hand whose `straight` fingers go `along`, the others folded back."""
    metric, along = np.zeros((21, 3)), np.array(along) / np.linalg.norm(along)
    for finger, (knuckle, off) in FINGERS.items():
        steps = (0, 1, 2, 3) if finger in straight else (0, 1, 0.6, 0.2)
        for joint, step in enumerate(steps):
            metric[knuckle + joint] = (0.0, off, 0.0) + 0.025 * step * along
    return HandRead(metric[:, :2] * 250 + at, metric)


def test_the_index_finger_alone_is_told_from_fist_and_open_hand():
    assert shape_of(read("index")) == "index"
    assert shape_of(read()) == "fist"
    assert shape_of(read("index", "middle", "ring", "little")) == "other"
    assert shape_of(read("index", "middle", "ring")) == "other"


@pytest.mark.parametrize(("along", "deg"), [((1, 0, 0), 90), ((-1, 0, 0), -90), ((0.1, 0, -1), 6), ((1, 0, 1), 135)])
def test_a_finger_points_where_it_goes(along, deg):
    assert pointing_deg(read("index", along=along)) == pytest.approx(deg, abs=1)


def test_a_finger_that_points_at_the_floor_tells_no_bearing():
    assert pointing_deg(read("index", along=(0.1, 1, 0))) is None


def tip_of(bearing_deg, is_left, length=4.2, elevation_deg=-5.0):
    """Where the camera sees the tip of a stretched arm, pixels."""
    bearing, elevation = math.radians(bearing_deg), math.radians(elevation_deg)
    aside = 1.1 if is_left else -1.1
    right = aside + length * math.cos(elevation) * math.sin(bearing)
    ahead = length * math.cos(elevation) * math.cos(bearing)
    down = 1.6 - length * math.sin(elevation)
    x, y = ((value - middle) / 560 for value, middle in zip(FACE, (319.5, 239.5), strict=True))
    away = DISTANCE_M / FACE_WIDTH_M
    return 319.5 + 560 * (x * away + right) / (away - ahead), 239.5 + 560 * (y * away + down) / (away - ahead)


@pytest.mark.parametrize("bearing_deg", [25, 45, 60, 75])
@pytest.mark.parametrize("is_left", [True, False])
def test_the_bearing_of_an_arm_is_found_with_its_finger(bearing_deg, is_left):
    own = bearing_deg if is_left else -bearing_deg
    seen = ArmSeen(FACE, WIDTH, tip_of(own, is_left), is_left, finger_deg=own)
    found = bearing_of(seen, LENS, SIZE, LEVEL)
    likeliest = BEARINGS[int(np.argmax(found.likelihood))]
    assert likeliest == pytest.approx(own, abs=15)
    assert abs(found.deg - own) < 2 * found.sigma_deg
    assert max(found.likelihood) == 1
    assert len(found.likelihood) == 72


def test_the_finger_tells_front_from_back():
    behind = bearing_of(ArmSeen(FACE, WIDTH, tip_of(120, True), True, finger_deg=125.0), LENS, SIZE, LEVEL)
    assert behind.deg > 90


def test_where_no_arm_reaches_nothing_is_known_of_the_bearing():
    found = bearing_of(ArmSeen(FACE, WIDTH, (5000.0, -4000.0), True, None), LENS, SIZE, LEVEL)
    assert found.sigma_deg > 60


def track(kind, x, y, width=WIDTH, track_id=0, observed=True):
    return Track(
        track_id=track_id, person_id=4, kind=kind, kind_probabilities=KindProbabilities(face=1.0), centroid_px=(x, y),
        bbox_px=(x - width / 2, y - 0.65 * width, width, 1.3 * width), velocity_px_s=(0.0, 0.0), observed=observed,
    )  # fmt: skip


class Player:
    """Plays the places of one left hand to the recognizer, thirty a second."""

    def __init__(self, shown):
        self.recognizer, self.seq, self.shown, self.asked = GestureRecognizer(GestureConfig()), 0, shown, 0

    def see(self, *place, run=1, panned_px=0.0):
        tracks = [track("face", FACE[0] + panned_px, FACE[1])]
        if place:
            x, y = (middle + WIDTH * value for middle, value in zip(FACE, place, strict=True))
            tracks.append(track("left_hand", x + panned_px, y, track_id=1))
        seen = Tracks(run=run, seq=self.seq, stamp_ns=10**18 + self.seq * 33_333_333, stage="tracker", instance="t",
                      width=640, height=480, tracks=tracks, room_offset_px=(panned_px, 0.0))  # fmt: skip
        self.seq += 1
        return self.recognizer.update(seen, LENS, LEVEL, self._read)

    def _read(self, track_id, place, face_px):
        self.asked += 1
        assert (track_id, face_px) == (1, pytest.approx(WIDTH))
        return self.shown(place)

    def play(self, *places):
        return [gesture for place in places for gesture in self.see(*place)]


RAISE = [(1.2 + n * 0.2, 4.2 - n * 0.25) for n in range(13)]
HELD = [RAISE[-1]] * 20


def pointing(place):
    return read("index", at=place)


def test_a_raised_still_index_finger_points_to_its_side():
    player = Player(pointing)
    said = player.play(*RAISE, *HELD)
    assert said[0].phase == "idle"
    assert "preparation" in [gesture.phase for gesture in said]
    last = said[-1]
    assert (last.person_id, last.phase, last.gesture, last.hand) == (4, "stroke", "point_left", "left")
    assert 30 < last.bearing_deg < 120
    assert len(last.fingertips_px) == 1
    away = player.play(*reversed(RAISE))
    assert away[-1].phase == "idle"
    assert "retraction" in [gesture.phase for gesture in away]


def test_an_open_hand_is_no_pointing():
    said = Player(lambda at: read("index", "middle", "ring", "little", at=at)).play(*RAISE, *HELD)
    assert said[-1].gesture == "other"


def test_a_fist_held_out_is_a_pointing_without_a_finger():
    assert Player(lambda at: read(at=at)).play(*RAISE, *HELD)[-1].gesture == "invisible"


def test_without_pictures_no_finger_is_claimed():
    said = Player(lambda _: None).play(*RAISE, *HELD)
    assert {gesture.gesture for gesture in said} <= {"none", "invisible"}
    assert said[-1].fingertips_px == []


def test_a_hand_held_still_is_still_also_while_the_camera_turns():
    player = Player(pointing)
    player.play(*RAISE)
    said = [player.see(*RAISE[-1], panned_px=4.0 * n)[0] for n in range(25)]
    assert (said[-1].phase, said[-1].gesture) == ("stroke", "point_left")


def test_a_wave_is_never_still():
    waved = [(2.0 + 0.6 * math.sin(n / 2), 0.0) for n in range(60)]
    assert all(gesture.phase != "stroke" for gesture in Player(pointing).play(*waved))


def test_fingers_of_hands_at_rest_are_not_read():
    player = Player(pointing)
    player.play(*[(0.8, 4.5)] * 20)
    assert player.asked == 0


def test_a_new_run_of_the_camera_begins_anew():
    player = Player(pointing)
    player.play(*RAISE, *HELD)
    assert player.see(*RAISE[-1], run=2)[0].phase != "stroke"


def test_who_has_no_face_has_no_gesture():
    seen = Tracks(run=1, seq=0, stamp_ns=1, stage="tracker", instance="t", width=640, height=480,
                  tracks=[track("left_hand", 400, 200)])  # fmt: skip
    assert GestureRecognizer(GestureConfig()).update(seen, LENS, LEVEL, lambda *_: None) == []
