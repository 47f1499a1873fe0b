"""Clips as another camera takes them: what the labels say stays true of the changed pictures."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from deixis_evaluation.clips import Clip, load_clips
from deixis_evaluation.true_angles import true_angles


@pytest.fixture(autouse=True)
def bench(monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder, as for `python bench/lineups.py`."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "bench"))


@pytest.fixture
def clip(clips: Path) -> Clip:
    return load_clips(clips, "pointing")[0]


def first_pictures(clip: Clip, count: int) -> list[np.ndarray]:
    read = cv2.VideoCapture(str(clip.video))
    return [read.read()[1] for _ in range(count)]


def test_a_grey_clip_has_no_colour(clip: Clip) -> None:
    from changed_clips import greyed

    with greyed([clip]) as (grey,):
        picture = first_pictures(grey, 1)[0].astype(int)
    assert np.abs(picture - picture.mean(axis=2, keepdims=True)).max() < 6
    assert grey.truth is clip.truth


def test_a_panned_clip_shows_the_person_where_its_labels_say(clip: Clip) -> None:
    from changed_clips import panned

    number, speed_px = 15, 2
    with panned([clip], speed_px) as (moved,):
        before, after = first_pictures(clip, number + 1)[-1], first_pictures(moved, number + 1)[-1]
        truth = moved.truth
    old, new = (item.frames[number].persons[0] for item in (clip.truth, truth))
    dx = round(new.head.center_px[0] - old.head.center_px[0])
    assert dx == number * speed_px
    x, y, width, height = (round(value) for value in old.face.bbox_visible)
    face = before[y : y + height, x : x + width].astype(int)
    shifted = after[y : y + height, x + dx : x + dx + width].astype(int)
    assert np.abs(face - shifted).mean() < 8  # packed once more


def test_the_camera_of_a_panned_clip_turns_on_the_floor_by_what_its_picture_moves(clip: Clip) -> None:
    from changed_clips import panned

    with panned([clip], 2) as (moved,):
        truth = moved.truth  # loading it has refused a camera that is tilted on the way
    assert truth.moves
    place = np.array([0.1, 1.4, -1.0])  # on the wall behind the person
    matrix = np.reshape(truth.meta.camera.matrix, (3, 3))
    for number in (0, 20, 40):
        view = truth.frames[number].camera
        assert view is not None
        seen = matrix @ (view.rotation @ (place - view.centre))
        still = matrix @ (clip.truth.meta.camera.rotation @ (place - clip.truth.meta.camera.centre))
        went = seen[0] / seen[2] - still[0] / still[2]
        labelled = [item.frames[number].persons[0].head.center_px[0] for item in (truth, clip.truth)]
        assert went == pytest.approx(labelled[0] - labelled[1], abs=6)  # a shift is nearly a turn
        old, new = (true_angles(item.frames[number].persons[0].head) for item in (clip.truth, truth))
        assert new.yaw == pytest.approx(old.yaw, abs=1)  # from the line to the camera, which stays where it is
