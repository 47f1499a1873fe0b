"""`deixis rehearse`: its options, its settings of the stages, and what it says of itself."""

import argparse
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from deixis_cli.options import CommandError
from deixis_evaluation.clips import Clip, load_truth
from deixis_runtime.site import load_site
from deixis_simulation.rehearsal.aims import aims_of
from deixis_simulation.rehearsal.answers import Answer
from deixis_simulation.rehearsal.command import estimate_s, in_words, refuse_to_go_on, register
from deixis_simulation.rehearsal.ground import ground_of
from deixis_simulation.rehearsal.performance import settings_for
from deixis_simulation.rehearsal.places import chosen_places
from deixis_simulation.rehearsal.trials import plan_trials

CLIPS = Path(__file__).parents[2] / "examples" / "clips"
SITE = Path(__file__).parents[2] / "examples" / "pointing.yaml"
CLIP = Clip("pointing", CLIPS / "pointing.mp4", load_truth(CLIPS / "pointing.json"))


def options(*arguments: str) -> argparse.Namespace:
    top = argparse.ArgumentParser()
    register(top.add_subparsers())
    return top.parse_args(["rehearse", "--site", "site.yaml", *arguments])


def test_places_are_read_in_all_ways_of_writing() -> None:
    given = options("--from", "2.0,0.5", "3,1", "--from=-1,-2.5", "--plan")
    assert given.places_m == [(2.0, 0.5), (3.0, 1.0), (-1.0, -2.5)]
    assert given.plan


@pytest.mark.parametrize(
    "arguments", [("--from", "nan,0"), ("--from", "1"), ("--count", "51"), ("--jobs", "x"), ("--places", "0")]
)
def test_bad_options_are_refused(arguments: tuple[str, str]) -> None:
    with pytest.raises(SystemExit):
        options(*arguments)


def test_the_clip_stands_in_for_the_camera_whatever_is_set(tmp_path: Path) -> None:
    ground = ground_of(load_site(SITE))
    sets = settings_for(CLIP, ground, tmp_path, {"camera": ("source=1",), "gesture": ("x=1",)})
    assert sets["camera"][0] == "source=1"
    assert sets["camera"][1:] == (f'source="{CLIP.video.resolve()}"', "loop=false")
    assert sets["fusion"] == (f'registry="{tmp_path / "pois.sqlite"}"',)
    assert sets["gesture"] == ("x=1",)


def test_a_calibration_with_distortion_is_replaced_by_the_clips_own(tmp_path: Path) -> None:
    ground = replace(ground_of(load_site(SITE)), pinhole_px=560.0)
    sets = settings_for(CLIP, ground, tmp_path, {})
    assert sets["camera"][-1] == f'calibration="{tmp_path / "pinhole.yaml"}"'
    content = yaml.safe_load((tmp_path / "pinhole.yaml").read_text())
    assert content["camera_matrix"]["data"][0] == 560.0


def test_estimate_grows_with_the_clips() -> None:
    ground = ground_of(load_site(SITE))
    aims = aims_of(ground, chosen_places(ground, 2))
    few, many = (plan_trials(ground, aims, count=count, seed=1, avatars=["a"]) for count in (1, 3))
    assert 0 < 2 * estimate_s(few, 1) < estimate_s(many, 1)
    assert estimate_s(many, 2) <= estimate_s(many, 1)
    assert estimate_s([], 1) == 0


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (Answer("t", "A", "x", ("x",), "named"), "named"),
        (Answer("t", "A", "x", ("x", "y"), "in_set"), "tied"),
        (Answer("t", "A", "x", ("y",), "wrong"), "mistaken"),
        (Answer("t", "A", "x", (), "missed"), "no answer"),
        (Answer("t", "A", None), "no answer, rightly"),
        (Answer("t", "A", None, false_answers=(("x",),)), "answered all the same"),
        (Answer("t", "A", "x", failure="no OpenGL"), "failed"),
    ],
)
def test_answers_in_words(answer: Answer, words: str) -> None:
    assert in_words(answer) == words


def test_it_does_not_go_on_where_nothing_works() -> None:
    failed = Answer("t", "A", "x", failure="no OpenGL")
    refuse_to_go_on([failed, failed])
    refuse_to_go_on([failed, failed, Answer("t", "A", "x", ("x",), "named")])
    with pytest.raises(CommandError, match="no OpenGL"):
        refuse_to_go_on([failed] * 3)
