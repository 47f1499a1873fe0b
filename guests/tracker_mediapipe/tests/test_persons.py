"""Who is followed: faces from frame to frame, whose hands they are, which of them is the left one."""

import numpy as np
import pytest
from deixis_tracker_mediapipe.config import TrackerConfig
from deixis_tracker_mediapipe.messages import tracks_of
from deixis_tracker_mediapipe.persons import LOOKS, Persons
from deixis_tracker_mediapipe.seen import FaceSeen, HandSeen

WIDTH = 50.0
FRAME_S = 1 / 30


def face(x, y=200.0, side=WIDTH, nose=0.0):
    return FaceSeen((x, y), side, nose, 0.9)


def hand(x, y, left, size=30.0):
    """A flat hand with its landmarks in a fan about a place."""
    angles = np.linspace(0, np.pi, 21)
    points = np.stack([x + size * np.cos(angles), y + size * np.sin(angles)], axis=1)
    points[0] = x, y - size / 2
    return HandSeen(points, left)


@pytest.fixture
def persons():
    return Persons(TrackerConfig())


def play(persons, frames, start_s=0.0):
    """Shows faces and hands frame by frame; the tracks after the last."""
    for number, (faces, hands) in enumerate(frames):
        persons.see_faces(faces, start_s + number * FRAME_S)
        persons.see_hands(hands)
    return {person.person_id: tracks_of(person) for person in persons.shown}


def test_a_face_seen_once_is_nobody_and_seen_again_it_is(persons):
    assert play(persons, [([face(300)], [])]) == {}
    (tracks,) = play(persons, [([face(300)], [])] * (LOOKS - 1), start_s=FRAME_S).values()
    assert [track.kind for track in tracks] == ["face"]
    assert tracks[0].frontal is not None
    assert tracks[0].centroid_px[0] == pytest.approx(300)
    assert tracks[0].bbox_px[2] == pytest.approx(1.02 * WIDTH)


def test_people_keep_their_ids_while_they_walk_past_each_other(persons):
    frames = [([face(200 + 4 * n, 180), face(440 - 4 * n, 260)], []) for n in range(60)]
    seen = play(persons, frames)
    assert sorted(seen) == [0, 1]
    assert seen[0][0].centroid_px[1] == pytest.approx(180, abs=6)
    assert seen[0][0].centroid_px[0] == pytest.approx(436, abs=6)


def test_a_face_that_is_lost_is_predicted_and_then_forgotten(persons):
    play(persons, [([face(300)], [])] * 5)
    (tracks,) = play(persons, [([], [])] * 5, start_s=5 * FRAME_S).values()
    assert not tracks[0].observed
    assert play(persons, [([], [])], start_s=5.0) == {}


def test_no_more_people_than_set_are_followed_and_that_is_counted():
    persons = Persons(TrackerConfig(max_persons=2))
    play(persons, [([face(100), face(300), face(500, side=40)], [])] * 3)
    assert len(persons.shown) == 2
    assert persons.left_out == 1


def test_a_hand_belongs_to_the_nearer_face_and_is_one_hand_where_two_regions_show_it(persons):
    faces = [face(200), face(440)]
    seen = play(persons, [(faces, [hand(480, 330, 0.9), hand(483, 332, 0.8)])] * 4)
    assert [len(tracks) for tracks in seen.values()] == [1, 2]


def test_nobody_has_two_left_hands(persons):
    seen = play(persons, [([face(300)], [hand(240, 330, 0.7), hand(360, 330, 0.95)])] * 4)
    kinds = {track.kind: track for track in seen[0]}
    assert set(kinds) == {"face", "left_hand", "right_hand"}
    assert kinds["left_hand"].centroid_px[0] > kinds["right_hand"].centroid_px[0]


def test_one_look_that_takes_a_hand_for_the_other_does_not_turn_it(persons):
    right = [([face(300)], [hand(240, 330, 0.05)])] * 10
    ids = {track.track_id for track in play(persons, right)[0]}
    seen = play(persons, [([face(300)], [hand(241, 330, 0.9)])], start_s=10 * FRAME_S)
    assert [track.kind for track in seen[0]] == ["face", "right_hand"]
    assert {track.track_id for track in seen[0]} == ids


def test_a_hand_that_is_far_from_every_face_is_nobodys(persons):
    seen = play(persons, [([face(100)], [hand(600, 400, 0.9)])] * 3)
    assert [track.kind for track in seen[0]] == ["face"]


def test_a_hand_unseen_has_no_outline_and_soon_no_track(persons):
    play(persons, [([face(300)], [hand(360, 330, 0.9)])] * 4)
    shown = play(persons, [([face(300)], [])], start_s=4 * FRAME_S)[0]
    assert [(track.observed, track.contour) for track in shown[1:]] == [(False, b"")]
    assert len(play(persons, [([face(300)], [])], start_s=1.0)[0]) == 1
