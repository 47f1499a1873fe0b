"""The gesture core on outlines cut from the true labels of rendered clips: what it makes of good tracks."""

import json

import cv2
import numpy as np
import pytest
from deixis_gesture.config import GestureConfig
from deixis_gesture.recognizer import GestureRecognizer
from deixis_runtime.lens import Lens
from deixis_schemas.messages import KindProbabilities, Track

POINTING = ("point_left", "point_right", "invisible")
LENS = Lens(640, 480, (560.0, 560.0, 319.5, 239.5))
HANDS = {"right_hand": 3, "left_hand": 4}


def _track(track_id, kind, box, contour=b""):
    x, y, w, h = (float(v) for v in box)
    return Track(
        track_id=track_id,
        person_id=0,
        kind=kind,
        kind_probabilities=KindProbabilities(**{kind: 1.0}),
        centroid_px=(x + w / 2, y + h / 2),
        bbox_px=(x, y, w, h),
        velocity_px_s=(0.0, 0.0),
        contour=contour,
    )


def _hand(labels, kind, part):
    outlines, _ = cv2.findContours(((labels & 15) == part).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not outlines:
        return []
    outline = max(outlines, key=cv2.contourArea)
    return [_track(part, kind, cv2.boundingRect(outline), outline[:, 0, :].astype("<i2").tobytes())]


def _gestures(folder, name, every):
    """(truth of the frame, gesture) of every so many frames of a clip with one person."""
    frames = json.loads((folder / f"{name}.json").read_text())["frames"]
    recognizer = GestureRecognizer(GestureConfig())
    answers = []
    width = frames[0]["persons"][0]["face"]["bbox_amodal"][2]
    with np.load(folder / f"{name}_labels.npz") as archive:
        for i in range(0, len(frames), every):
            labels = cv2.imdecode(archive[f"f{i:04d}"], cv2.IMREAD_UNCHANGED)
            truth = frames[i]["persons"][0]
            x, y, w, h = truth["face"]["bbox_amodal"]
            tracks = [_track(0, "face", (x + w / 2 - width / 2, y, width, h))]
            for kind, part in HANDS.items():
                tracks += _hand(labels, kind, part)
            (gesture,) = recognizer.update(tracks, 640, 480, LENS, 1, 10**18 + i * 10**9 // 30)
            answers.append((truth, gesture))
    return answers


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize(
    ("name", "expected", "hand"),
    [
        ("a02_point_m60", "point_right", "right"),
        ("c08_point_p20", "point_left", "left"),
        ("c14_point_p130", "invisible", "left"),
        ("c16_point_m60_small", "point_right", "right"),
        ("c19_point_m40_crossarm", "point_right", "left"),
    ],
)
def test_a_pointing_is_recognised_through_its_stroke(rendered, name, expected, hand, every):
    answers = _gestures(rendered, name, every)
    stroke = [gesture for truth, gesture in answers if truth["phase"] == "stroke"]
    settled = stroke[13 // every + 1 :]
    assert {(g.phase, g.gesture, g.hand) for g in settled} == {("stroke", expected, hand)}
    apart = [truth["phase"] for truth, g in answers if g.gesture in POINTING and truth["phase"] not in ("stroke", "retraction")]
    assert apart == []
    azimuth = next(truth["poi_azimuth_deg"] for truth, _ in answers if truth["phase"] == "stroke")
    said = settled[-1]
    options = [said.bearing_deg, np.copysign(180, said.bearing_deg) - said.bearing_deg][: 1 + said.bearing_mirrored]
    assert min(abs(option - azimuth) for option in options) < 2 * said.bearing_sigma_deg


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize("name", ["a05_wave", "a06_stop", "a12_facepass", "d01_wave_left", "a08_idle"])
def test_what_is_no_pointing_is_never_called_one(rendered, name, every):
    assert not [g.gesture for _, g in _gestures(rendered, name, every) if g.gesture in POINTING]
