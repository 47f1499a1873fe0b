"""Scores of the headpose stage on made-up heads, where each figure is known beforehand."""

import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from deixis_cli.options import CommandError
from deixis_evaluation.angle_scores import AngleScore, signed_error_deg
from deixis_evaluation.clips import TrueHead
from deixis_evaluation.head_samples import HeadSample, angle_score
from deixis_evaluation.headpose_command import check_headpose
from deixis_evaluation.headpose_plot import broken, draw_heads
from deixis_evaluation.headpose_report import HeadposeConditions, headpose_report
from deixis_evaluation.headpose_scores import HEAD_BANDS, HeadposeScore, head_band, score_bands, score_heads
from deixis_evaluation.headpose_table import print_headpose
from deixis_evaluation.true_angles import MIRROR, TrueAngles, true_angles
from deixis_headpose.head import facing_camera, rotation_of
from deixis_schemas.messages import HeadPose
from pydantic import ValidationError
from rich.console import Console


def tracked(true_yaw: float, yaw: float, sigma: float = 2.0, frame: int = 0, **angles: Any) -> HeadSample:
    true = TrueAngles(true_yaw, angles.pop("true_pitch", None), angles.pop("true_roll", None))
    pose = HeadPose(person_id=0, status="tracking", yaw_deg=yaw, yaw_sigma_deg=sigma, **angles)
    return HeadSample(frame, 0, true, pose)


def said(true_yaw: float, status: Any, side: Any = None, frame: int = 0) -> HeadSample:
    return HeadSample(frame, 0, TrueAngles(true_yaw), HeadPose(person_id=0, status=status, side=side))


# --- bands ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("yaw", "band"),
    [
        (0, "0-15"), (-14.9, "0-15"), (15, "15-30"), (-45, "30-60"), (60, "60-90"), (-90, "90-130"), (129.9, "90-130"),
        (130, "beyond_130"), (-180, "beyond_130"),
    ],
)  # fmt: skip
def test_a_head_falls_into_the_band_of_its_true_yaw(yaw: float, band: str) -> None:
    assert head_band(yaw) == band


def test_each_band_has_the_figures_of_its_own_heads() -> None:
    bands = score_bands([tracked(10, 12), tracked(-10, -14), tracked(70, 40), said(100, "out_of_range", "left")])
    assert list(bands) == list(HEAD_BANDS)
    assert [score.frames for score in bands.values()] == [2, 0, 0, 1, 1, 0]
    assert bands["0-15"].yaw.mae_deg == pytest.approx(3)
    assert bands["60-90"].yaw.mae_deg == pytest.approx(30)
    assert bands["90-130"].answered.share == 0
    assert bands["15-30"].answered.share is None
    assert bands["15-30"].yaw.mae_deg is None


def test_errors_are_taken_around_the_circle_with_mean_median_and_percentile() -> None:
    assert signed_error_deg(-179, 179) == pytest.approx(2)
    assert signed_error_deg(170, -170) == pytest.approx(-20)
    score = AngleScore([-1.0, 2.0, -3.0, 14.0], [None] * 4)
    assert (score.mae_deg, score.bias_deg, score.percentile_deg(50)) == (5.0, 3.0, 2.5)
    assert score.percentile_deg(90) == pytest.approx(np.percentile([1, 2, 3, 14], 90))
    assert score.sigma_median_deg is None


# --- what is said wrong ------------------------------------------------------------------------------------------------------


def test_a_large_error_is_silent_where_its_sigma_is_small() -> None:
    score = score_heads([tracked(0, 25, 3), tracked(0, 25, 12), tracked(0, 25, 10), tracked(0, 19.9, 3), said(0, "lost")])
    assert (score.large.hits, score.large.total) == (3, 4)
    assert (score.silent.hits, score.silent.total) == (1, 4)
    assert (score.answered.hits, score.answered.total) == (4, 5)


def test_statuses_are_counted_and_a_head_nobody_speaks_of_is_absent() -> None:
    samples = [
        tracked(0, 0),
        said(0, "lost"),
        said(0, "initialising"),
        said(99, "out_of_range"),
        HeadSample(0, 0, TrueAngles(0)),
    ]
    assert score_heads(samples).statuses == {"tracking": 1, "out_of_range": 1, "initialising": 1, "lost": 1, "absent": 1}


def test_a_side_is_right_by_the_sign_of_the_yaw_or_in_words() -> None:
    right = [tracked(40, 5), tracked(-40, -60), said(120, "out_of_range", "left"), said(-120, "out_of_range", "right")]
    wrong = [tracked(40, -5), said(120, "out_of_range", "right")]
    silent = [said(120, "out_of_range"), said(120, "lost"), HeadSample(0, 0, TrueAngles(120))]
    score = score_heads(right + wrong + silent)
    assert (score.side_said.hits, score.side_right.hits, score.side_right.total) == (6, 4, 9)


# --- coverage ----------------------------------------------------------------------------------------------------------------


def test_coverage_of_a_true_sigma_is_68_and_95_percent() -> None:
    random = np.random.default_rng(7)
    sigmas = random.uniform(1, 8, 4000)
    errors = random.normal(0, sigmas)
    score = AngleScore(errors.tolist(), sigmas.tolist())
    assert score.within(1.0).share == pytest.approx(0.683, abs=0.025)
    assert score.within(1.96).share == pytest.approx(0.95, abs=0.012)
    half = AngleScore(errors.tolist(), (sigmas / 2).tolist())
    assert half.within(1.0).share == pytest.approx(0.383, abs=0.025)  # who claims half of it is found out
    assert half.within(1.96).share == pytest.approx(0.673, abs=0.025)


def test_coverage_counts_errors_to_both_sides_up_to_the_sigma_and_only_those_that_state_one() -> None:
    score = AngleScore([1.0, -1.0, 1.1, -1.9, -2.1], [1.0, 1.0, 1.0, 1.0, None])
    assert (score.within(1.0).hits, score.within(1.0).total) == (2, 4)
    assert score.within(1.96).hits == 4


def test_yaw_pitch_and_roll_are_covered_by_their_own_variances() -> None:
    covariance = (4.0, 0.0, 0.0, 9.0, 0.0, 16.0)
    heads = [
        tracked(0, 1.9, 2.0, covariance_deg2=covariance, pitch_deg=13.1, roll_deg=-3.9, true_pitch=10.0, true_roll=0.0),
        tracked(0, 2.1, 2.0, covariance_deg2=covariance, pitch_deg=12.9, roll_deg=-4.1, true_pitch=10.0, true_roll=0.0),
        tracked(0, 2.1, 2.0, pitch_deg=12.9, roll_deg=-4.1, true_pitch=10.0, true_roll=0.0),
        tracked(0, 2.1, 2.0, pitch_deg=12.9, roll_deg=-4.1),
    ]
    yaw, pitch, roll = (angle_score(heads, angle) for angle in ("yaw", "pitch", "roll"))
    assert (yaw.within(1.0).hits, yaw.within(1.0).total) == (1, 4)
    assert (pitch.within(1.0).hits, pitch.within(1.0).total, pitch.frames) == (1, 2, 3)
    assert (roll.within(1.0).hits, roll.within(1.0).total, roll.frames) == (1, 2, 3)
    assert pitch.errors_deg[0] == pytest.approx(3.1)


# --- true angles -------------------------------------------------------------------------------------------------------------


def head(rotation_in_camera: np.ndarray, centre: tuple[float, float, float], yaw: float = 0.0) -> TrueHead:
    """A labelled head by its rotation in camera axes, as headpose has it."""
    labelled = MIRROR @ rotation_in_camera @ MIRROR
    return TrueHead(yaw_rel_deg=yaw, center_px=(1, 1), center_cam=centre, R_cam=labelled.ravel().tolist())


@pytest.mark.parametrize("centre", [(0.0, 0.0, 2.0), (0.8, -0.5, 1.6), (-1.2, 0.3, 2.0)])
def test_a_head_that_looks_at_the_camera_off_axis_has_no_pitch_and_no_roll(centre: tuple[float, float, float]) -> None:
    # Its forward axis in the labels' axes (z toward the camera, y up) along the line to the camera, its right level.
    forward = MIRROR @ -np.array(centre) / np.linalg.norm(centre)
    across = np.cross([0.0, 1.0, 0.0], forward)
    across /= np.linalg.norm(across)
    labelled = np.stack([across, np.cross(forward, across), forward], axis=1)
    true = true_angles(TrueHead(yaw_rel_deg=0, center_px=(1, 1), center_cam=centre, R_cam=labelled.ravel().tolist()))
    assert (true.pitch, true.roll) == pytest.approx((0, 0), abs=1e-6)


def test_pitch_is_up_and_roll_is_of_the_crown_to_the_right_of_the_picture() -> None:
    up = math.radians(20)
    nods = [1, 0, 0, 0, math.cos(up), math.sin(up), 0, -math.sin(up), math.cos(up)]  # its forward axis, the last column, rises
    true = true_angles(TrueHead(yaw_rel_deg=0, center_px=(1, 1), center_cam=(0, 0, 2), R_cam=nods))
    assert (true.pitch, true.roll) == pytest.approx((20, 0), abs=1e-6)
    leans = [math.cos(up), math.sin(up), 0, -math.sin(up), math.cos(up), 0, 0, 0, 1]  # its up axis, the middle column, to +x
    true = true_angles(TrueHead(yaw_rel_deg=0, center_px=(1, 1), center_cam=(0, 0, 2), R_cam=leans))
    assert (true.pitch, true.roll) == pytest.approx((0, 20), abs=1e-6)


def test_angles_are_those_of_the_stages_own_convention() -> None:
    centre = (0.6, -0.4, 1.8)
    turned = facing_camera(np.array(centre)) @ rotation_of(*np.radians([50.0, -12.0, 7.0]))
    true = true_angles(head(turned, centre, yaw=49.0))
    assert true == pytest.approx((49.0, -12.0, 7.0), abs=1e-6)  # yaw is the labels' own


def test_labels_without_rotation_have_yaw_alone_and_one_that_is_none_is_refused() -> None:
    assert true_angles(TrueHead(yaw_rel_deg=5, center_px=(1, 1), center_cam=(0, 0, 2))) == TrueAngles(5)
    with pytest.raises(ValidationError, match="R_cam: not a rotation"):
        TrueHead(yaw_rel_deg=5, center_px=(1, 1), R_cam=[1, 0, 0, 0, 1, 0, 0, 0, -1])


# --- what is told ------------------------------------------------------------------------------------------------------------


def scores() -> list[HeadposeScore]:
    turning = [tracked(yaw, yaw + 1, 2.0, frame) for frame, yaw in enumerate(range(0, 100, 5))]
    beyond = [said(175 - 350 * (frame % 2), "out_of_range", "left", frame) for frame in range(20, 24)]
    return [
        HeadposeScore("a [good] $one$", "point", 24, [*turning, *beyond]),
        HeadposeScore("broken", "point", 9, failure="no [video]"),
        HeadposeScore("empty", "quiet", 9),
    ]


def test_the_report_is_json_and_has_the_same_figures_as_the_scores() -> None:
    content = json.loads(json.dumps(headpose_report(HeadposeConditions(Path("clips")), scores(), {"cpu": "x"})))
    assert content["stage"] == "headpose"
    assert content["summary"]["failed"] == ["broken"]
    assert (content["summary"]["clips"], content["summary"]["frames"], content["summary"]["heads"]["frames"]) == (3, 42, 24)
    good = content["clips"]["a [good] $one$"]
    assert good["heads"]["yaw"]["mae_deg"] == pytest.approx(1)
    assert good["heads"]["yaw"]["within_1_sigma"] | {"interval_95": None} == {
        "share": 1,
        "hits": 20,
        "of": 20,
        "interval_95": None,
    }
    assert good["heads"]["answered"]["interval_95"] == pytest.approx([0.641, 0.933], abs=0.001)
    assert good["bands"]["beyond_130"]["status"]["out_of_range"] == 4
    assert content["clips"]["broken"]["failure"] == "no [video]"
    assert content["clips"]["empty"]["heads"]["answered"]["share"] is None


def test_the_tables_name_clips_and_bands_and_say_what_is_meant() -> None:
    console = Console(file=io.StringIO(), width=150)
    print_headpose(console, scores())
    text = console.file.getvalue()  # type: ignore[attr-defined]
    for words in (
        "a [good] $one$",
        "failed: no [video]",
        "beyond 130",
        "within 1.96 σ",
        "4 out of range",
        "not, so the truth is wider",
    ):
        assert words in text


@pytest.mark.parametrize("number", [0, 2])
def test_a_clip_is_drawn_also_where_nobody_is_in_it(tmp_path: Path, number: int) -> None:
    draw_heads(tmp_path / "a.png", scores()[number])
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_yaw_that_passes_180_is_drawn_with_a_gap() -> None:
    frames, angles, sigma = broken(np.array([170.0, 178.0, -174.0, -166.0]), np.array([1.0, 2.0, 3.0, 4.0]))
    np.testing.assert_equal(angles, [170, 178, np.nan, -174, -166])
    np.testing.assert_equal(sigma, [1, 2, np.nan, 3, 4])
    np.testing.assert_equal(frames, [0, 1, np.nan, 2, 3])


# --- usage -------------------------------------------------------------------------------------------------------------------


def test_settings_reach_the_cores_that_are_played() -> None:
    setup = check_headpose((), {"headpose": ["gate=0.6"], "tracker": ["max_persons=2"]})
    assert (setup.headpose.gate, setup.tracker.max_persons, setup.true_tracks) == (0.6, 2, False)
    assert check_headpose(("tracker",), {}).true_tracks


@pytest.mark.parametrize(
    ("truth", "sets", "named"),
    [
        (("headpose",), {}, "the truth can stand for tracker alone"),
        ((), {"gesture": ["x=1"]}, "only tracker and headpose are played"),
        (("tracker",), {"tracker": ["max_persons=2"]}, "only headpose are played"),
        ((), {"headpose": ["gaet=0.6"]}, "settings of headpose: gaet: unknown key"),
        ((), {"headpose": ["gate=7"]}, "settings of headpose: gate"),
    ],
)
def test_what_does_not_go_with_the_stage_alone_is_refused(
    truth: tuple[str, ...], sets: dict[str, list[str]], named: str
) -> None:
    with pytest.raises(CommandError, match=named):
        check_headpose(truth, sets)
