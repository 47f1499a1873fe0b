"""`deixis skin`: P(skin) and mask of pictures as files."""

import cv2
import numpy as np
import pytest
from deixis_cli.main import main
from deixis_cli.options import CommandError
from deixis_evaluation.skin_command import outputs_of
from deixis_tracker.skin import SkinModel

SKIN, WALL = (140, 165, 215), (200, 150, 110)


@pytest.fixture
def picture(tmp_path):
    """Skin at the left, a blue wall at the right."""
    path = tmp_path / "hand.png"
    image = np.full((80, 120, 3), WALL, np.uint8)
    image[:, :60] = SKIN
    cv2.imwrite(str(path), image)
    return path


def read(folder, name):
    return cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)


def test_probability_is_the_trackers_and_the_mask_is_where_skin_is_likelier(tmp_path, picture):
    out = tmp_path / "new" / "out"
    assert main(["skin", str(picture), "--out", str(out)]) == 0
    probability, mask = read(out, "hand.probability.png"), read(out, "hand.mask.png")
    assert np.array_equal(probability, SkinModel(0.2).probability(cv2.imread(str(picture))))
    assert np.array_equal(mask == 255, probability >= 128)
    assert (mask[:, :60] == 255).all()
    assert (mask[:, 60:] == 0).all()


def test_settings_of_the_tracker_count(tmp_path, picture):
    assert main(["skin", str(picture), "--out", str(tmp_path / "out"), "--set", "tracker.prior_skin=0.001"]) == 0
    assert not read(tmp_path / "out", "hand.mask.png").any()


@pytest.mark.parametrize("channels", [1, 3])
def test_a_picture_without_colour_has_no_skin(tmp_path, channels):
    grey = np.random.default_rng(1).integers(0, 256, (70, 90), np.uint8)
    cv2.imwrite(str(tmp_path / "grey.png"), grey if channels == 1 else np.dstack([grey] * 3))
    assert main(["skin", str(tmp_path / "grey.png"), "--out", str(tmp_path)]) == 0
    assert not read(tmp_path, "grey.probability.png").any()


def test_what_cannot_be_read_is_told_and_the_others_are_written(tmp_path, picture, capsys):
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(b"no picture")
    out = tmp_path / "out"
    assert main(["skin", str(broken), str(tmp_path / "absent.png"), str(picture), "--out", str(out)]) == 1
    said = capsys.readouterr().err
    assert "picture 'broken.jpg'" in said
    assert "No such file" in said
    assert "2 of 3 pictures failed" in said
    assert sorted(path.name for path in out.iterdir()) == ["hand.mask.png", "hand.probability.png"]


def test_an_input_is_never_overwritten(tmp_path, picture, capsys):
    other = tmp_path / "hand.mask.png"
    other.write_bytes(picture.read_bytes())
    before = other.read_bytes()
    assert main(["skin", str(picture), str(other), "--out", str(tmp_path)]) == 1
    assert "'hand.mask.png' there is one of the pictures" in capsys.readouterr().err
    assert other.read_bytes() == before


def test_two_pictures_of_one_name_are_refused(tmp_path):
    with pytest.raises(CommandError, match="'hand': two pictures"):
        outputs_of([tmp_path / "a" / "hand.png", tmp_path / "b" / "hand.jpg"], tmp_path / "out")


def test_a_folder_that_cannot_be_made_and_a_setting_of_another_stage_are_refused(tmp_path, picture, capsys):
    assert main(["skin", str(picture), "--out", str(picture)]) == 1
    assert main(["skin", str(picture), "--out", str(tmp_path), "--set", "fusion.x=1"]) == 1
    said = capsys.readouterr().err
    assert "--out" in said
    assert "--set fusion" in said
