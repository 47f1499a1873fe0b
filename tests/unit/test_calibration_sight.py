"""`deixis doctor --camera`: what the tracker sees of the shipped example, made worse in known ways, and what is said of it."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from deixis_calibration.looking import Looking
from deixis_calibration.picture_measures import measure
from deixis_calibration.sight_advice import advise, of_light
from deixis_calibration.sight_check import Pairs
from deixis_calibration.sight_picture import COLOURS, draw_sight
from deixis_cli.main import main
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, Producer, Tracks
from deixis_tracker.config import TrackerConfig

ROOT = Path(__file__).parents[2]
STEP_NS = 200_000_000


@pytest.fixture(scope="module")
def frames():
    """Two seconds of the example clip: somebody who stands there with both hands in sight."""
    clip = cv2.VideoCapture(str(ROOT / "examples" / "pointing.mp4"))
    return [clip.read()[1] for _ in range(42)][::6]


@pytest.fixture(scope="module")
def good(frames):
    """What is seen of them as they are."""
    return seen_of(frames, lambda frame: frame)


def seen_of(frames, change):
    looking = Looking(TrackerConfig())
    for number, frame in enumerate(frames):
        looking.add(change(frame), 0, number * STEP_NS)
    return looking.seen()


def far_away(frame):
    wide = np.full_like(frame, 120)
    small = cv2.resize(frame, None, fx=0.4, fy=0.4, interpolation=cv2.INTER_AREA)
    wide[100 : 100 + small.shape[0], 200 : 200 + small.shape[1]] = small
    return wide


def grey(frame):
    return cv2.cvtColor(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)


def test_a_good_picture_is_said_to_be_good(good):
    found = list(advise(good))
    assert {finding.level for finding in found} == {"ok"}
    assert found[0].what.startswith("face 4")
    assert found[1].what == "2 hands seen at once"


@pytest.mark.parametrize(
    ("change", "what", "advice"),
    [
        (lambda frame: (frame * 0.3).astype(np.uint8), "the face is too dark: brightness 3", "light the person"),
        (lambda frame: cv2.GaussianBlur(frame, (0, 0), 3.5), "the picture is blurred: 0.7", "focus the lens"),
        (grey, "the picture is grey", "take a colour camera"),
        (far_away, "px wide: too small", "come nearer"),
        (lambda frame: np.ascontiguousarray(frame[:, 250:]), "is near the picture's left edge", "stand in the middle"),
    ],
)
def test_what_is_wrong_is_said_with_what_to_do(frames, change, what, advice):
    wrong = [finding for finding in advise(seen_of(frames, change)) if finding.level != "ok"]
    assert len(wrong) == 1
    assert what in wrong[0].what
    assert advice in wrong[0].advice


@pytest.mark.parametrize(
    ("light", "what"),
    [(20, "the face is much darker than the rest: brightness 20 of 12"), (240, "the face is overexposed: brightness 240")],
)
def test_the_light_on_a_face_is_judged_beside_that_of_the_picture(good, light, what):
    found = list(of_light(replace(good, faces=(replace(good.faces[0], light=light),))))
    assert [finding.what.startswith(what) for finding in found] == [True]


@pytest.mark.parametrize(
    ("level", "what"),
    [
        (0, "the picture is too dark: brightness 0"),
        (120, "the picture has no edges"),
        (255, "overexposed: 100 % of it is white"),
    ],
)
def test_an_empty_picture_is_told_by_its_light(level, what):
    found = [finding.what for finding in advise(seen_of([np.full((240, 320, 3), level, np.uint8)] * 3, lambda frame: frame))]
    assert any(what in text for text in found)
    assert "no face found in 3 pictures" in found


def test_blur_does_not_depend_on_the_size_of_the_picture(frames):
    large = cv2.resize(frames[0], (1920, 1440), interpolation=cv2.INTER_LINEAR)
    assert measure(large).blur == pytest.approx(measure(frames[0]).blur, abs=0.08)


def test_the_picture_shows_tracks_skin_and_words(good):
    canvas = draw_sight(good, list(advise(good)))
    left, right = canvas[30:510, 12:652], canvas[30:510, 664:1304]
    assert (left == COLOURS["face"]).all(axis=2).sum() > 100
    x, y, w, h = (round(value) for value in good.faces[0].box)
    face, wall = right[y : y + h, x : x + w], right[:100]
    assert np.ptp(face.astype(int), axis=2).mean() > 20  # in colour
    assert np.ptp(wall.astype(int), axis=2).mean() < 1


def test_doctor_looks_through_a_source_and_writes_the_picture(frames, tmp_path, capsys):
    picture, folder = tmp_path / "sight.png", tmp_path / "pictures"
    folder.mkdir()
    for number, frame in enumerate(frames):
        cv2.imwrite(str(folder / f"{number}.png"), frame)
    words = ["doctor", "--robot", "none", "--local", "--source", str(folder), "--camera", str(picture), "--json"]
    main(words)
    said = [finding["what"] for finding in json.loads(capsys.readouterr().out)["findings"]]
    assert any(text.startswith("face 4") for text in said)
    assert cv2.imread(str(picture)).shape[1] == 1316


def test_doctor_says_where_there_is_nothing_to_look_at(tmp_path, capsys):
    assert main(["doctor", "--robot", "none", "--local", "--camera"]) == 1
    assert "--camera with --local needs --source" in capsys.readouterr().err
    words = ["doctor", "--robot", "none", "--local", "--source", str(tmp_path / "no.mp4"), "--camera", str(tmp_path / "s.png")]
    assert main(words) == 1
    assert "camera: nothing to look at: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("source", "picture", "said"),
    [
        ("v.mp4", "v.mp4", "v.mp4: takes the name of the picture to draw, one that ends in .png"),
        ("v.mp4", "README.md", "README.md: takes the name of the picture to draw"),
        ("v.png", "v.png", "v.png: is the --source itself"),
        ("v.png", "link.png", "link.png: is the --source itself"),
        ("v.mp4", "hard.png", "hard.png: is the --source itself"),
        ("pictures.png", "pictures.png/1.png", "pictures.png/1.png: is the --source itself, or in its folder"),
        ("v.mp4", "nodir/s.png", "nodir/s.png: there is no folder 'nodir'"),
        ("v.mp4", "pictures.png", "pictures.png: is a folder"),
    ],
)
def test_doctor_draws_over_no_file_but_an_earlier_picture(source, picture, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in ("v.mp4", "v.png", "README.md"):
        (tmp_path / name).write_text("dear to somebody")
    (tmp_path / "link.png").symlink_to("v.png")
    (tmp_path / "hard.png").hardlink_to("v.mp4")
    (tmp_path / "pictures.png").mkdir()
    assert main(["doctor", "--local", "--source", source, "--camera", picture]) == 1
    heard = capsys.readouterr()
    assert (heard.out, heard.err.count("\n")) == ("", 1)
    assert said in heard.err
    assert {(tmp_path / name).read_text() for name in ("v.mp4", "v.png", "README.md")} == {"dear to somebody"}


def messages(seq):
    frame = Frame(
        run=1, seq=seq, stamp_ns=seq, stage="camera", instance="c", width=2, height=2, encoding="mono8", data=bytes(4)
    )
    return frame, Tracks.derive(frame, Producer("tracker", "t"), width=2, height=2, tracks=[])


def test_a_frame_is_shown_with_its_own_tracks_or_with_none_where_no_tracker_runs():
    pairs, alone = Pairs(), Pairs()
    for seq in range(3):
        frame, tracks = messages(seq)
        alone.hear(topics.FRAME.key("r"), codec.encode(frame), codec.encoding_of(Frame))
        pairs.hear(topics.FRAME.key("r"), codec.encode(frame), codec.encoding_of(Frame))
        if seq == 1:
            pairs.hear(topics.TRACKS.key("r"), codec.encode(tracks), codec.encoding_of(Tracks))
    assert [(shot.stamp_ns, shot.tracks) for shot in pairs.take()] == [(1, [])]
    assert list(pairs.rest()) == []
    assert [(shot.stamp_ns, shot.tracks) for shot in (*alone.take(), *alone.rest())] == [(0, None), (1, None), (2, None)]
