"""Rehearsal: from answers to a confusion matrix, sentences, table, JSON and map."""

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import cv2
import pytest
import yaml
from deixis_evaluation.clip_score import ClipScore, failed_clip
from deixis_evaluation.clips import load_truth
from deixis_evaluation.episode_scores import EpisodeScore, EpisodeScores, FalseEpisode
from deixis_runtime.site import load_site
from deixis_simulation.rehearsal.advice import advise
from deixis_simulation.rehearsal.aims import aims_of
from deixis_simulation.rehearsal.answers import Answer, answer_of
from deixis_simulation.rehearsal.confusion import confusion_of
from deixis_simulation.rehearsal.floor_map import draw_map
from deixis_simulation.rehearsal.ground import Ground, ground_of
from deixis_simulation.rehearsal.places import given_places
from deixis_simulation.rehearsal.report import print_report, report
from rich.console import Console

ROOT = Path(__file__).parents[2]
POIS = [
    {"poi_id": "vase", "name": "the vase", "position_m": [2.0, 1.5, 1.2]},
    {"poi_id": "clock", "name": "the clock", "position_m": [2.3, 1.6, 1.2]},
    {"poi_id": "door", "name": "the door", "position_m": [2.0, -1.5, 1.2]},
    {"poi_id": "cellar", "name": "the cellar", "position_m": [2.0, -3.0, 1.2]},
]
WALLS = [[[0.0, -2.0], [4.0, -2.0]]]


@pytest.fixture
def ground(tmp_path: Path) -> Ground:
    path = tmp_path / "site.yaml"
    path.write_text(yaml.safe_dump({"name": "a [small] room", "pois": POIS, "walls": WALLS}))
    return ground_of(load_site(path))


def answer(asked: str | None, *poi_ids: str, **others: object) -> Answer:
    outcome = None if asked is None else "missed"
    if asked is not None and poi_ids:
        outcome = "wrong" if asked not in poi_ids else "named" if len(poi_ids) == 1 else "in_set"
    return Answer("trial", "A", asked, poi_ids, **{"outcome": outcome, **others})


ANSWERS = [
    *[answer("vase", "vase")] * 2,
    answer("vase", "clock", cause="close"),
    answer("clock", "vase", "clock", cause="close"),
    answer("clock", "vase", "clock", cause="close"),
    answer("clock", cause="not_seen"),
    answer("door", "vase", cause="hand_off", false_answers=(("vase",),)),
    answer(None),
    answer(None, false_answers=(("door",),)),
    Answer("A_door_1", "A", "door", failure="no OpenGL"),
]


def test_answers_are_counted_by_poi(ground: Ground) -> None:
    aims = aims_of(ground, given_places(ground, [(2.0, 0.0)]))
    confusion = confusion_of(aims, ANSWERS)
    results = {result.poi.poi_id: result for result in confusion.results}
    assert [results[name].verdict for name in ("vase", "clock", "door", "cellar")] == [
        "told_apart",
        "tied",
        "confused",
        "untried",
    ]
    assert results["vase"].named_share == pytest.approx(2 / 3)
    assert results["clock"].confused_with == Counter(vase=2)
    assert results["cellar"].named_share is None
    assert confusion.matrix["A", "clock"] == Counter({frozenset({"vase", "clock"}): 2, frozenset(): 1})
    assert (confusion.quiet, confusion.quiet_answered, confusion.extra_answers) == (2, 1, 1)
    assert confusion.failures == (("A_door_1", "no OpenGL"),)
    assert confusion.confused_pairs() == [("clock", "vase", 3), ("door", "vase", 1)]
    assert (confusion.tries, confusion.named, confusion.all_told_apart) == (7, 2, False)


def test_advice_says_what_to_do(ground: Ground) -> None:
    aims = aims_of(ground, given_places(ground, [(2.0, 0.0)]))
    confusion = confusion_of(aims, ANSWERS)
    said = {item.topic: item.text for item in advise(ground, aims, confusion)}
    assert said["close"].startswith("The vase and the clock lie 11° apart seen from A (2.0, 0.0)")
    assert said["close"].endswith("move one, or accept a tie.")
    assert said["wall"] == "Seen from A (2.0, 0.0), the cellar stands behind a wall: nobody points at it from there."
    assert said["confused"] == (
        "The door was named 0 of 1 times; answered instead: the vase 1. Why: the hand's direction was misread (1)."
    )
    assert said["false"].startswith("1 answer came besides")
    assert "no OpenGL" in said["failed"]


def test_close_pair_that_was_not_confused_is_told_so(ground: Ground) -> None:
    aims = aims_of(ground, given_places(ground, [(2.0, 0.0)]))
    good = confusion_of(aims, [answer(name, name) for name in ("vase", "clock", "door")])
    close = next(item.text for item in advise(ground, aims, good) if item.topic == "close")
    assert "not confused this time" in close


def test_advice_about_the_picture(ground: Ground) -> None:
    near = advise(ground, aims_of(ground, given_places(ground, [(1.4, -0.4)])), None)
    outside = next(item for item in near if item.topic == "hand_outside")
    assert "holds the fingertip out of the picture (60° wide)" in outside.text


def test_advice_tells_from_where_on_a_head_is_out_of_range_by_the_setting_of_headpose(tmp_path: Path) -> None:
    said = {}
    for method, range_deg in (("regression", 130), ("regression", 100), ("ellipsoid", 130)):
        path, headpose = tmp_path / "site.yaml", {"method": method, "range_deg": range_deg}
        path.write_text(yaml.safe_dump({"pois": POIS, "settings": {"headpose": headpose}}))
        ground = ground_of(load_site(path))
        advice = advise(ground, aims_of(ground, given_places(ground, [(1.4, -0.4)])), None)
        said[method, range_deg] = next((item.text for item in advice if item.topic == "beyond_reach"), "")
    assert said["regression", 130].startswith("The door (135°) lies beyond 130° from the line to the camera")
    assert " lie beyond 100° from the line to the camera" in said["regression", 100]
    assert said["ellipsoid", 130] == said["regression", 100]


def test_report_reads_as_json_and_on_screen(ground: Ground) -> None:
    places = given_places(ground, [(2.0, 0.0)])
    aims = aims_of(ground, places)
    confusion = confusion_of(aims, ANSWERS)
    advice = advise(ground, aims, confusion)
    content = json.loads(json.dumps(report(ground, places, aims, confusion, advice, complete=True, seed=3)))
    assert content["summary"] == {
        "pointings": 7, "named": 2, "told_apart": 1, "pois": 4, "quiet": 2, "quiet_answered": 1, "extra_answers": 1,
    }  # fmt: skip
    assert content["pois"]["clock"]["confused_with"] == {"vase": 2}
    assert content["places"]["A"]["pois"]["cellar"]["hidden"] == "wall"
    assert {"poi_ids": ["clock", "vase"], "times": 2} in content["places"]["A"]["pois"]["clock"]["answers"]
    console = Console(width=140, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    print_report(console, places, confusion, advice)
    text = console.export_text()
    assert "Told apart: 1 of 4 points of interest. Named: 2 of 7 pointings." in text
    assert "2 of 3" in text


@pytest.mark.parametrize("tried", [True, False])
def test_map_is_a_png(ground: Ground, tmp_path: Path, tried: bool) -> None:
    places = given_places(ground, [(2.0, 0.0), (2.8, 0.5)])
    aims = aims_of(ground, places)
    draw_map(tmp_path / "map.png", ground, places, aims, confusion_of(aims, ANSWERS) if tried else None)
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    picture = cv2.imread(str(tmp_path / "map.png"))
    assert picture is not None
    assert 500 < picture.shape[0] < 1600
    assert 500 < picture.shape[1] < 1800


def test_dollars_in_names_are_no_formula(ground: Ground, tmp_path: Path) -> None:
    odd = replace(ground, name="$a_b$", pois=tuple(replace(poi, name="$100% off$") for poi in ground.pois))
    places = given_places(odd, [(2.0, 0.0)])
    draw_map(tmp_path / "map.png", odd, places, aims_of(odd, places), None)
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


TRUTH = load_truth(ROOT / "examples" / "clips" / "pointing.json")


def scored(**changes: object) -> ClipScore:
    strokes = [frame for frame in TRUTH.frames if frame.persons and frame.persons[0].points]
    episode = {
        "person": 0, "poi": "vase", "azimuth_deg": -90.0, "frames": (strokes[0].frame, strokes[-1].frame), "outcome": "wrong",
        "answered": True, "poi_ids": ("door",), "target_frames": None, "conflict": None, "reason": "", "side": "right",
        "gestures": {}, "yaw_deg": -80.0, "true_yaw_deg": -85.0, "head": {}, "bearing_deg": -88.0,
    }  # fmt: skip
    return ClipScore("x", "point", "pointing", 10, answers=EpisodeScores((EpisodeScore(**{**episode, **changes}),)))


@pytest.mark.parametrize(
    ("changes", "cause"),
    [
        ({}, "unclear"),
        ({"outcome": "named", "poi_ids": ("vase",)}, None),
        ({"poi_ids": ("clock",)}, "close"),
        ({"answered": False, "poi_ids": (), "outcome": "missed"}, "not_seen"),
        ({"yaw_deg": -50.0}, "head_off"),
        ({"side": "wrong"}, "hand_off"),
        ({"bearing_deg": -60.0}, "hand_off"),
        ({"yaw_deg": -20.0, "true_yaw_deg": -25.0}, "looked_away"),
    ],
)
def test_cause_of_an_answer(ground: Ground, changes: dict[str, object], cause: str | None) -> None:
    aims = aims_of(ground, given_places(ground, [(2.0, 0.0)]))
    said = answer_of("trial", "A", aims[0], aims, scored(**changes), TRUTH)
    assert said.cause == cause


def test_failed_and_quiet_trials(ground: Ground) -> None:
    aims = aims_of(ground, given_places(ground, [(2.0, 0.0)]))
    assert answer_of("t", "A", aims[0], aims, failed_clip("x", TRUTH, "too slow"), TRUTH).failure == "too slow"
    false = EpisodeScores((), (FalseEpisode((1.0, 2.0), ("door",), ""),))
    quiet = answer_of("t", "A", None, aims, ClipScore("x", "quiet", "quiet", 10, answers=false), TRUTH)
    assert quiet.false_answers == (("door",),)
    assert quiet.outcome is None
