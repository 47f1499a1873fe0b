"""`deixis eval --stage tracker --video`: what is drawn, and what is refused."""

import json
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from deixis_cli.main import main
from deixis_cli.options import CommandError
from deixis_evaluation.clips import TrueFrame, load_clips
from deixis_evaluation.tracker_drawing import COLOURS, draw_tracks
from deixis_evaluation.tracker_video import VideoError, check_video, drawn_into
from deixis_schemas.messages import KindProbabilities, Track

SIDE = 400


def hand(kind="right_hand", **changed):
    outline = np.array([[100, 100], [160, 100], [160, 160], [100, 160]], "<i2")
    said = {
        "track_id": 3,
        "person_id": 1,
        "kind": kind,
        "kind_probabilities": KindProbabilities(**{kind: 0.9, "face": 0.1}),
        "centroid_px": (130.0, 130.0),
        "bbox_px": (100.0, 100.0, 60.0, 60.0),
        "velocity_px_s": (0.0, 0.0),
        "contour": outline.tobytes(),
    }
    return Track(**{**said, **changed})


def drawn(*tracks, truth=None):
    return draw_tracks(np.zeros((SIDE, SIDE, 3), np.uint8), tracks, truth or TrueFrame(frame=0), "a title")


def pixels_of(image, colour):
    return np.all(image == np.array(colour, np.uint8), axis=2)


@pytest.mark.parametrize("kind", ["left_hand", "right_hand", "unknown"])
def test_a_track_is_drawn_in_the_colour_of_its_kind_at_twice_the_size(kind):
    image = drawn(hand(kind))
    assert image.shape == (2 * SIDE, 2 * SIDE, 3)
    rows, columns = np.nonzero(pixels_of(image, COLOURS[kind]))
    assert abs(columns.min() - 200) <= 2
    assert abs(rows.max() - 320) <= 2


def test_the_box_of_a_prediction_is_dashed():
    seen, predicted = (drawn(hand(contour=b"", observed=observed)) for observed in (True, False))
    edge = np.s_[205:315, 200]
    assert pixels_of(seen, COLOURS["right_hand"])[edge].all()
    assert 0.3 < pixels_of(predicted, COLOURS["right_hand"])[edge].mean() < 0.7


def test_a_track_that_leaves_the_picture_is_drawn_as_far_as_it_is_in_it():
    assert drawn(hand(bbox_px=(-30.0, -30.0, 60.0, 60.0))).any()


def test_labels_do_not_lie_upon_each_other(monkeypatch):
    written = []
    monkeypatch.setattr(cv2, "putText", lambda _image, text, at, *_: written.append((text, at)))
    drawn(hand(), hand("left_hand", track_id=4), hand("unknown", track_id=5, person_id=None))
    places = [at for text, at in dict.fromkeys(written) if text[1:3] == ": "]
    assert len(places) == len({y for _, y in places}) == 3
    assert {text for text, _ in written} == {
        *("1: right 0.90, face 0.10", "1: left 0.90, face 0.10", "?: unknown 0.90, face 0.10"),
        "a title",
    }


def test_the_truth_is_drawn_in_white(clips):
    truth = load_clips(clips, "pointing")[0].truth.frames[70]
    image = draw_tracks(np.zeros((480, 640, 3), np.uint8), [], truth, "")
    x, y, w, h = (round(2 * value) for value in truth.persons[0].face.bbox_visible)
    assert pixels_of(image, (255, 255, 255))[y + 5 : y + h - 5, [x, x + w]].all()


def test_a_clip_is_never_overwritten(clips, tmp_path):
    with pytest.raises(CommandError, match=r"'pointing.mp4' there is a clip that is played"):
        check_video(clips, load_clips(clips, "pointing"))
    check_video(tmp_path / "new", load_clips(clips, "pointing"))
    assert (tmp_path / "new").is_dir()


def test_a_video_that_cannot_be_opened_is_an_error(clips, tmp_path):
    (tmp_path / "small.mp4").mkdir()
    with pytest.raises(VideoError, match="cannot be written"), drawn_into(tmp_path, load_clips(clips, "small")[0]):
        pytest.fail("it was opened")


def test_the_video_has_each_frame_of_the_clip(clips, tmp_path):
    out, scores = tmp_path / "video", tmp_path / "scores.json"
    given = ["eval", "--stage", "tracker", str(clips), "--only-clips", "small", "--video", str(out), "--json", str(scores)]
    assert main(given) == 0
    video = cv2.VideoCapture(str(out / "small.mp4"))
    size = SimpleNamespace(width=video.get(cv2.CAP_PROP_FRAME_WIDTH), height=video.get(cv2.CAP_PROP_FRAME_HEIGHT))
    assert (size.width, size.height) == (640, 480)
    assert int(video.get(cv2.CAP_PROP_FRAME_COUNT)) == json.loads(scores.read_text())["summary"]["frames"] == 63


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--video", "x"], "goes with --stage tracker"),
        (["--stage", "headpose", "--video", "x"], "goes with --stage tracker"),
        (["--stage", "tracker", "--out", "x"], "draws with --video DIR"),
    ],
)
def test_what_does_not_go_together_is_refused(clips, capsys, options, said):
    assert main(["eval", str(clips), *options]) == 1
    assert said in capsys.readouterr().err
