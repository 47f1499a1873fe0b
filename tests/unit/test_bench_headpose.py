"""The benchmark of head pose methods: its figures, the turn of an aligned patch, and what it says of what is not there."""

import json
import math
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Literal

import cv2
import numpy as np
import pytest

BENCH = Path(__file__).parents[2] / "bench"
TURN_DEG = 25.0


@pytest.fixture(autouse=True)
def bench(monkeypatch: pytest.MonkeyPatch) -> None:
    """The benchmarks' folder, as for `python bench/headpose.py`."""
    monkeypatch.syspath_prepend(str(BENCH))


def said(yaw_deg: float, sigma_deg: float | None = None, x: float = 100.0):
    from headpose_methods import Said

    return Said((x - 20, 80.0, 40.0, 40.0), yaw_deg, sigma_deg)


# --- figures --------------------------------------------------------------------------------------------------------------


def test_pairs_of_one_person_are_ordered_by_their_labels() -> None:
    from headpose_figures import ordered_share

    assert ordered_share([(-15.0, -9.0), (0.0, 1.0), (0.0, 4.0), (15.0, 3.0)]) == (4, 5)
    assert ordered_share([(0.0, 1.0), (15.0, 1.0)]) == (0, 1)  # the same yaw for both is no order
    assert ordered_share([(15.0, 1.0)]) == (0, 0)


def test_labels_in_steps_count_signs_only_of_turned_heads_and_order_only_within_a_person() -> None:
    from headpose_figures import steps

    figures = steps([[(15.0, 12.0), (0.0, -3.0), (-15.0, None)], [(-30.0, 2.0), (-15.0, -20.0)]])
    assert figures["answered_share"] == pytest.approx(4 / 5)
    assert figures["ordered_share"] == pytest.approx(1 / 2)
    assert figures["sign_share"] == pytest.approx(2 / 3)
    assert figures["error_deg"] == pytest.approx((3 + 3 + 32 + 5) / 4)
    assert set(steps([[]]).values()) == {None}


def test_intervals_cover_the_differences_that_lie_within_them() -> None:
    from headpose_figures import coverage

    pairs = [(said(0, 2.0), 1.0), (said(0, 2.0), -3.0), (said(0, 2.0), 5.0), (said(0), 90.0)]
    assert coverage(pairs, 1.0) == pytest.approx(1 / 3)
    assert coverage(pairs, 1.96) == pytest.approx(2 / 3)
    assert coverage(pairs[3:], 1.0) is None


def test_agreement_asks_only_where_the_referee_sees_a_face_and_differs_only_where_it_can_be_believed() -> None:
    from headpose_figures import agreement

    frames = [[said(10, 5.0)], [said(20, 5.0)], [], [said(0, 5.0)], [said(0, 5.0, x=400.0)]]
    referee = [[said(12)], [said(60)], [said(0)], [], [said(0)]]
    figures = agreement(frames, referee)
    assert figures["difference_deg"] == pytest.approx(2.0)
    assert figures["answered_share"] == pytest.approx(2 / 4)
    assert figures["within_68_share"] == 1.0


def test_a_constant_difference_is_told_from_the_rest() -> None:
    from headpose_figures import agreement

    own, referee = [2.0, 3.0, 12.0, -8.0], [10.0, 10.0, 21.0, 0.0]
    figures = agreement([[said(yaw)] for yaw in own], [[said(yaw)] for yaw in referee])
    assert figures["difference_deg"] == figures["offset_deg"] == pytest.approx(8.0)
    assert figures["rest_deg"] == pytest.approx(0.5)


def test_errors_are_silent_where_no_large_sigma_warns_of_them() -> None:
    from headpose_figures import Labels

    labels = Labels()
    for true_deg, own in ((10, said(40, 3.0)), (10, said(40, 15.0)), (10, said(40)), (-50, said(-45, 3.0)), (100, None)):
        labels.count(float(true_deg), own)
    figures = labels.figures()
    assert figures["silent_share"] == pytest.approx(2 / 4)
    assert figures["error_deg_0-30"] == pytest.approx(30.0)
    assert figures["error_deg_30-60"] == pytest.approx(5.0)
    assert figures["outward_deg_30-60"] == pytest.approx(-5.0)
    assert figures["error_deg_60-90"] is None
    assert figures["answered_share_90-130"] == 0.0


# --- methods --------------------------------------------------------------------------------------------------------------


def warp_of(yaw_deg: float, roll_deg: float = 0.0, scale: float = 1.0) -> np.ndarray:
    """The map of a patch that has turned with its head, on a canvas in whose middle the head's axis is."""
    import affine_alignment as alignment

    yaw, roll = math.radians(yaw_deg), math.radians(roll_deg)
    turn = np.array([[math.cos(roll), -math.sin(roll)], [math.sin(roll), math.cos(roll)]])
    linear = scale * turn @ np.diag([math.cos(yaw), 1.0])
    shift = scale * turn @ np.array([alignment.RADIUS * alignment.FACE_PX * yaw, 0.0])
    middle = (np.array(alignment.PATCH_PX) - 1) / 2
    return np.hstack([linear, (shift + (alignment.CANVAS_PX - 1) / 2 - linear @ middle)[:, None]])


@pytest.mark.parametrize("yaw_deg", [-60.0, -10.0, 0.0, 30.0, 80.0])
def test_the_yaw_of_a_known_map_is_read_whatever_roll_and_distance(yaw_deg: float) -> None:
    from affine_alignment import frontal_warp, squeeze_of, yaw_of

    assert yaw_of(warp_of(yaw_deg)) == pytest.approx(yaw_deg)
    assert yaw_of(warp_of(yaw_deg, roll_deg=20.0, scale=1.3)) == pytest.approx(yaw_deg)
    assert squeeze_of(warp_of(yaw_deg, roll_deg=20.0, scale=1.3)) == pytest.approx(math.cos(math.radians(yaw_deg)))
    assert np.allclose(frontal_warp(), warp_of(0.0))


def test_a_patch_drawn_by_a_known_map_is_aligned_to_its_yaw() -> None:
    from affine_alignment import CANVAS_PX, PATCH_PX, FacePatch, drawn_back, frontal_warp

    random = np.random.default_rng(1)
    coarse = random.integers(40, 220, (40, 40), dtype=np.uint8)
    front = cv2.resize(coarse, (CANVAS_PX, CANVAS_PX), interpolation=cv2.INTER_CUBIC)
    centre = ((CANVAS_PX - 1) / 2, (CANVAS_PX - 1) / 2)
    patch = FacePatch.of(cv2.merge([front] * 3), centre, centre, 64.0, 0)
    for number, yaw_deg in enumerate(np.arange(5.0, TURN_DEG + 1, 5.0), 1):
        to_front = cv2.invertAffineTransform(warp_of(yaw_deg))
        to_front[:, 2] += frontal_warp()[:, 2]
        turned = cv2.warpAffine(front, to_front, (CANVAS_PX, CANVAS_PX), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        yaw = patch.follow(cv2.merge([turned] * 3), centre, number)
        assert yaw == pytest.approx(yaw_deg, abs=1.0)
    assert drawn_back(turned, patch.warp).shape == PATCH_PX[::-1]
    assert patch.follow(np.full((CANVAS_PX, CANVAS_PX, 3), 90, np.uint8), centre, 99) is None


def test_the_methods_are_those_of_the_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    import headpose_methods
    from deixis_runtime.settings import ConfigError, StageConfig

    class Config(StageConfig):
        method: Literal["affine", "views"] = "views"
        gate: float = 0.5

    names = headpose_methods.deixis_methods()
    assert names[0] == "regression"
    assert set(names) == {"regression", "ellipsoid", "affine"}
    assert headpose_methods.maker_of(names[0], ["gate=0.6"])()
    with pytest.raises(ConfigError, match="gates"):
        headpose_methods.maker_of(names[0], ["gates=0.6"])
    with pytest.raises(ValueError, match="no method 'eec'"):
        headpose_methods.maker_of("eec", [])
    monkeypatch.setattr(headpose_methods, "HeadposeConfig", Config)
    assert headpose_methods.deixis_methods() == ("views", "affine")
    assert headpose_methods.config_of("affine", ["gate=0.6"]) == Config(method="affine", gate=0.6)


# --- the referee ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("yaw", "pitch", "roll"), [(0, 0, 0), (40, 0, 0), (-30, 20, 10), (70, -15, -20)])
def test_the_referee_has_the_angles_of_deixis(yaw: float, pitch: float, roll: float) -> None:
    from deixis_headpose.head import rotation_of
    from mediapipe_referee import GENERIC_HEAD_MM, angles_deg, pnp_yaw_deg

    turn = rotation_of(*np.radians([yaw, pitch, roll]))
    assert angles_deg(turn[:, 0], turn[:, 1]) == pytest.approx((yaw, pitch, roll), abs=1e-6)
    seen = np.array(list(GENERIC_HEAD_MM.values())) @ turn.T + (0.0, 0.0, 1500.0)
    pixels = 550 * seen[:, :2] / seen[:, 2:] + (319.5, 239.5)
    assert pnp_yaw_deg(pixels, (640, 480), 550.0) == pytest.approx(yaw, abs=0.1)


REFEREE = """
import json, sys
jobs = json.load(sys.stdin)
face = {"bbox_px": [80, 80, 40, 40], "yaw_deg": 5.0, "pnp_yaw_deg": None}
json.dump({name: {"cpu_s": 0.1, "frames": [[face] for _ in job["paths"]]} for name, job in jobs.items()}, sys.stdout)
"""


def test_what_the_referee_said_is_kept_until_the_pictures_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import mediapipe_answers
    from headpose_inputs import Source

    picture, script = tmp_path / "picture.jpg", tmp_path / "stand_in.py"
    picture.write_bytes(b"1")
    script.write_text(REFEREE)
    monkeypatch.setattr(mediapipe_answers, "REFEREE", script)
    source = Source("driver/1", (picture,), shown=3)
    asked = mediapipe_answers.ask([source], Path(sys.executable), tmp_path)
    footage = SimpleNamespace(source=source, frames=[None] * 3)
    answers = mediapipe_answers.answers_of("facemesh", footage, asked)
    assert [[one.yaw_deg for one in frame] for frame in answers.frames] == [[5.0]] * 3
    assert mediapipe_answers.answers_of("facemesh_pnp", footage, asked).frames == [[]] * 3
    script.write_text("import mediapipe_that_is_not_there")
    assert mediapipe_answers.ask([source], Path(sys.executable), tmp_path) == asked
    picture.write_bytes(b"12")
    with pytest.raises(mediapipe_answers.RefereeError, match="mediapipe_that_is_not_there"):
        mediapipe_answers.ask([source], Path(sys.executable), tmp_path)


def test_an_interpreter_without_mediapipe_is_told_what_to_do(tmp_path: Path) -> None:
    from headpose_inputs import Source
    from mediapipe_answers import RefereeError, ask

    (tmp_path / "picture.jpg").write_bytes(b"1")
    with pytest.raises(RefereeError, match=r"bench/requirements\.txt"):
        ask([Source("driver/1", (tmp_path / "picture.jpg",))], Path(sys.executable), None)
    with pytest.raises(RefereeError, match="cannot be asked"):
        ask([Source("driver/1", (tmp_path / "picture.jpg",))], tmp_path / "none", None)


# --- the whole ------------------------------------------------------------------------------------------------------------


def test_drivers_are_measured_and_what_is_not_there_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from headpose import main

    folder = tmp_path / "drivface"
    folder.mkdir()
    cv2.imwrite(str(folder / "d_1.jpg"), np.full((240, 320, 3), 90, np.uint8))
    (folder / "drivPoints.txt").write_text("fileName,subject,ang,xF,yF,wF,hF\nd_1,1,15,100,80,60,70\nd_2,1,0,100,80,60,70\n")
    out = tmp_path / "figures.json"
    assert main(["--real", str(tmp_path), "--no-mediapipe", "--json", str(out)]) == 0
    figures = json.loads(out.read_text())["figures"]
    assert figures["drivers_ecc_answered_share"] == 0
    assert figures["drivers_ecc_sign_share"] is None
    told = capsys.readouterr()
    assert "signers: left out" in told.err
    assert "labelled clips: left out" in told.err
    assert main(["--real", str(tmp_path / "none"), "--no-mediapipe"]) == 1
    assert "nothing to measure" in capsys.readouterr().err
    assert main(["--real", str(tmp_path), "--methods", "eec", "--no-mediapipe"]) == 1
    assert "no method 'eec'" in capsys.readouterr().err
