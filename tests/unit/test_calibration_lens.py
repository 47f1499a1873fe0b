"""`deixis calibrate camera` and `board`: the lens behind pictures of a board, what speaks against it, and what is refused."""

import json

import cv2
import numpy as np
import pytest
from board_views import DISTORTION, MATRIX, SIZE, VIEWS, sightings, views
from deixis_calibration.album import Album
from deixis_calibration.board_command import sheet_of
from deixis_calibration.boards import Board, BoardError
from deixis_calibration.coverage import cover, hint
from deixis_calibration.gathering import gather
from deixis_calibration.lens_advice import advice, tells_focal
from deixis_calibration.lens_fit import LensFitError, fit_lens
from deixis_calibration.picture_sources import Named, PictureSource
from deixis_calibration.sightings import finder_of
from deixis_camera.calibration import load_calibration
from deixis_cli.main import main
from rich.console import Console

CHARUCO = Board("charuco", 7, 5, 0.036, 0.027)
CHESS = Board("chessboard", 9, 7, 0.03)
MIDDLE = [(0.5, 0.5, 2.4, 0, 0, roll) for roll in range(0, 60, 5)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of twelve pictures of the board, and one without."""
    made = tmp_path_factory.mktemp("boards")
    for number, picture in enumerate(views(CHARUCO)):
        cv2.imwrite(str(made / f"view{number}.png"), picture)
    cv2.imwrite(str(made / "without.png"), np.full(SIZE[::-1], 90, np.uint8))
    return made


def calibrate(*words):
    return main(["calibrate", "camera", *map(str, words)])


def advised(board, seen):
    fit = fit_lens(board, seen, "plumb_bob")
    return " | ".join(advice(fit, cover(board, seen)))


def test_the_lens_of_rendered_boards_is_found_and_read_by_the_camera_stage(folder, tmp_path, capsys):
    out = tmp_path / "lens.yaml"
    assert calibrate(folder, "--out", out, "--json") == 0
    said = json.loads(capsys.readouterr().out)
    found = load_calibration(out)
    assert (found.width, found.height) == SIZE
    assert np.allclose(found.camera_matrix[::4][:2], (MATRIX[0, 0], MATRIX[1, 1]), rtol=0.01)
    assert np.allclose(np.array(found.camera_matrix).reshape(3, 3)[:2, 2], MATRIX[:2, 2], atol=4)
    assert np.allclose(found.distortion, DISTORTION, atol=0.03)
    assert said["rms_px"] < 0.4
    assert len(said["pictures"]) == 12
    assert said["refused"] == {"without.png": "no board found"}
    picture = cv2.imread(str(tmp_path / "lens.png"))
    assert picture.shape[1] > 1200


def test_a_chessboard_is_found_in_its_pictures():
    find = finder_of(CHESS)
    seen = [find(str(number), picture) for number, picture in enumerate(views(CHESS, [VIEWS[0], VIEWS[1], VIEWS[4], VIEWS[5]]))]
    assert all(sighting is not None for sighting in seen)
    fit = fit_lens(CHESS, seen, "plumb_bob")
    assert fit.matrix[0, 0] == pytest.approx(MATRIX[0, 0], rel=0.01)


def test_a_fisheye_is_measured_by_its_own_model():
    seen = sightings(CHESS)
    straight = [cv2.undistortPoints(one.px[:, None].astype(np.float64), MATRIX, DISTORTION) for one in seen]
    bent = [cv2.fisheye.distortPoints(at, MATRIX, np.array([0.05, -0.01, 0, 0])).reshape(-1, 2) for at in straight]
    again = [type(one)(one.name, one.size, one.ids, px.astype(np.float32)) for one, px in zip(seen, bent, strict=True)]
    fit = fit_lens(CHESS, again, "equidistant")
    assert fit.matrix[0, 0] == pytest.approx(MATRIX[0, 0], rel=0.01)
    assert fit.distortion[0] == pytest.approx(0.05, abs=0.02)


def test_the_board_that_is_printed_is_found_with_all_corners(tmp_path):
    sheet = np.asarray(sheet_of(CHARUCO))
    small = cv2.resize(sheet, None, fx=0.3, fy=0.3, interpolation=cv2.INTER_AREA)
    assert len(finder_of(CHARUCO)("sheet", small).ids) == CHARUCO.corners
    for name in ("board.png", "board.pdf"):
        assert main(["calibrate", "board", "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")
    assert main(["calibrate", "board", "--out", str(tmp_path / "board.png")]) == 1


def test_markers_of_no_size_are_refused_and_not_taken_for_the_default(tmp_path, capsys):
    assert main(["calibrate", "board", "--marker", "0", "--out", str(tmp_path / "board.png")]) == 1
    assert "markers of 0 m" in capsys.readouterr().err
    assert not (tmp_path / "board.png").exists()


def test_pictures_without_a_board_are_refused_by_a_sentence_and_nothing_is_written(tmp_path, capsys):
    for number in range(3):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full(SIZE[::-1], 90, np.uint8))
    assert calibrate(tmp_path, "--out", tmp_path / "lens.yaml") == 1
    said = capsys.readouterr().err
    assert "was found in none of 3 pictures" in said
    assert "no board found (0.png, 1.png, 2.png)" in said
    assert not (tmp_path / "lens.yaml").exists()


def test_a_board_of_other_squares_is_not_found(folder, tmp_path, capsys):
    assert calibrate(folder / "view0.png", "--squares", "11x9", "--pattern", "chessboard", "--out", tmp_path / "lens.yaml") == 1
    assert "are --pattern, --squares and --dictionary right" in capsys.readouterr().err


def test_two_pictures_are_too_few(folder, tmp_path, capsys):
    assert calibrate(folder / "view0.png", folder / "view1.png", "--out", tmp_path / "lens.yaml") == 1
    assert "seen in 2 pictures: 3 are the fewest" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "give SOURCE, or --robot"),
        (("nowhere.png",), "no such file or folder"),
        (("README.md",), "not a video: it holds text"),
        (("a.png", "--squares", "7"), "not of the form 7x5"),
        (("a.png", "--square", "0"), "squares of 0 m"),
        (("a.png", "--marker", "0.05"), "30 to 99 % of a square"),
        (("a.png", "--squares", "12x9"), "take 54 markers, DICT_4X4_50 has 50"),
        (("a.png", "--out", "no/folder/lens.yaml"), "there is no folder"),
        (("a.png", "--out", "README.md"), "--force writes over it"),
    ],
)
def test_bad_usage_is_refused_by_name(words, said, capsys):
    assert calibrate(*words) == 1
    assert said in capsys.readouterr().err


def test_boards_of_one_tilt_in_the_middle_of_the_picture_are_warned_of():
    said = advised(CHARUCO, sightings(CHARUCO, MIDDLE))
    assert "nearly the same tilt" in said
    assert "% of the picture: bring it to all parts" in said
    assert "edge at the left, right, top, bottom" in said


@pytest.mark.parametrize("focal_px", [300, 400, 600, 2000])
@pytest.mark.parametrize(
    "places",
    [
        [(x, y, far, 0, 0, 0) for x in (0.25, 0.5, 0.75) for y in (0.3, 0.5, 0.7) for far in (1.5, 2.2)],
        [(0.5, 0.5, far, 0, 0, roll) for far in (1.2, 2, 4) for roll in range(0, 60, 15)],
        [(0.5, 0.5, 1.2, 35, 10, 0)] * 12,
    ],
    ids=["everywhere", "in the middle", "copies"],
)
def test_of_boards_of_one_tilt_no_lens_tells_its_focal_length(places, focal_px, monkeypatch):
    monkeypatch.setattr("board_views.MATRIX", np.array([[focal_px, 0, 325.0], [0, focal_px, 236.0], [0, 0, 1]]))
    told = []
    for chosen in (places, VIEWS):
        seen = sightings(CHARUCO, chosen)
        told.append(tells_focal(fit_lens(CHARUCO, seen, "plumb_bob"), cover(CHARUCO, seen)))
    assert told == [False, True]


def test_a_focal_length_that_is_not_determined_is_no_success_and_no_percentage_is_stated(folder, tmp_path, capsys):
    for number in range(12):
        (tmp_path / f"{number}.png").write_bytes((folder / "view1.png").read_bytes())
    assert calibrate(tmp_path, "--out", tmp_path / "lens.yaml") == 3
    said = capsys.readouterr().out
    assert "focal length not determined: all boards had one tilt" in said
    assert "+-" not in said
    assert "nearly the same tilt" in (tmp_path / "lens.yaml").read_text()
    assert calibrate(tmp_path, "--out", tmp_path / "lens.yaml", "--force", "--json") == 3
    document = json.loads(capsys.readouterr().out)
    assert (document["focal_determined"], document["focal_sigma"]) == (False, None)


def test_good_pictures_are_warned_of_only_where_they_are():
    assert advised(CHESS, sightings(CHESS)) == ""
    assert "5 pictures are few" in advised(CHESS, sightings(CHESS)[:5])
    assert "the error is" in advised(CHESS, sightings(CHESS, noise_px=2.0))


def test_a_blurred_picture_is_left_out_and_named():
    seen = sightings(CHESS)
    rng = np.random.default_rng(1)
    bad = seen[3]
    seen[3] = type(bad)(bad.name, bad.size, bad.ids, bad.px + rng.normal(0, 8, bad.px.shape).astype(np.float32))
    fit = fit_lens(CHESS, seen, "plumb_bob")
    assert [picture.sighting.name for picture in fit.odd] == ["view3"]
    assert fit.rms_px < 0.3
    assert "do not fit the others and were left out (blurred, or the board bent): view3" in " ".join(
        advice(fit, cover(CHESS, seen))
    )


@pytest.mark.parametrize("small", [["view0"], ["view3", "view7", "view11"]])
def test_the_size_that_most_pictures_have_is_measured_whichever_comes_first(small, folder, tmp_path, capsys):
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    for path in folder.glob("view*.png"):
        picture = cv2.imread(str(path))
        cv2.imwrite(str(pictures / path.name), cv2.resize(picture, (480, 360)) if path.stem in small else picture)
    assert calibrate(pictures, "--out", tmp_path / "lens.yaml") == 0
    assert (load_calibration(tmp_path / "lens.yaml").width, load_calibration(tmp_path / "lens.yaml").height) == SIZE
    said = capsys.readouterr().out
    assert f"{len(small)} of them: of 480 x 360 pixels, most of 640 x 480: a lens is measured at one size (view" in said
    assert f"over {12 - len(small)} pictures" in said


def test_of_as_many_pictures_of_two_sizes_the_larger_are_measured():
    album = Album(CHESS, only_new=False, only_still=False)
    seen = sightings(CHESS)
    for one in seen[:3]:
        album.add(one.name, type(one)(f"small {one.name}", (320, 240), one.ids, one.px / 2))
    assert len(album.kept) == 3
    for one in seen[3:6]:
        album.add(one.name, one)
    assert [one.name for one in album.kept] == ["view3", "view4", "view5"]
    assert list(album.refused) == ["small view0", "small view1", "small view2"]


def test_pictures_of_two_sizes_are_no_lens():
    seen = sightings(CHESS)
    seen[2] = type(seen[2])("wide", (1280, 720), seen[2].ids, seen[2].px)
    with pytest.raises(LensFitError, match="640 x 480, 1280 x 720"):
        fit_lens(CHESS, seen, "plumb_bob")


def test_a_live_board_is_kept_where_it_is_still_and_new():
    album = Album(CHESS, only_new=True, only_still=True)
    first, _, third = sightings(CHESS, noise_px=0.0)[:3]
    assert [album.add(name, one) for name, one in enumerate([first, first, first, None, third, third])] == [
        *(False, True, False, False, False, True)
    ]
    assert list(album.refused.values()) == ["the board moves", "like one that is kept", "no board found", "the board moves"]


def test_the_hint_names_what_is_missing_until_nothing_is():
    seen = sightings(CHESS)
    assert hint(cover(CHESS, [])).startswith("Hold the board")
    assert hint(cover(CHESS, seen[1:2])).startswith("Bring the board to the")
    assert "Tilt the board" in hint(cover(CHESS, sightings(CHESS, [(0.5, 0.5, 1.0, 0, 0, 0)] * 3)))
    assert hint(cover(CHESS, seen)) == "" or "nearer" in hint(cover(CHESS, seen))


class StoppedAfter:
    """Stands for Ctrl-C after so many pictures."""

    def __init__(self, pictures):
        self.left = pictures

    def requested(self):
        self.left -= 1
        return self.left < 0


def test_what_was_seen_until_ctrl_c_is_kept():
    seen = iter(sightings(CHESS))
    pictures = [Named(str(number), np.zeros((4, 4), np.uint8)) for number in range(12)]
    album = Album(CHESS, only_new=False, only_still=False)
    source = PictureSource("pictures", iter(pictures), len(pictures))
    gather(source, lambda _name, _image: next(seen), album, StoppedAfter(5), Console(quiet=True))
    assert len(album.kept) == 5
    assert fit_lens(CHESS, album.kept, "plumb_bob").matrix[0, 0] == pytest.approx(MATRIX[0, 0], rel=0.02)


def test_a_video_of_a_board_is_measured(folder, tmp_path, capsys):
    video = cv2.VideoWriter(str(tmp_path / "board.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 25, SIZE)
    for number in range(8):
        for _ in range(5):
            video.write(cv2.imread(str(folder / f"view{number}.png")))
    video.release()
    assert calibrate(tmp_path / "board.avi", "--out", tmp_path / "lens.yaml") == 0
    found = load_calibration(tmp_path / "lens.yaml")
    assert found.camera_matrix[0] == pytest.approx(MATRIX[0, 0], rel=0.01)
    assert "8 pictures are few" in capsys.readouterr().out


def test_a_board_too_small_for_its_markers_is_none():
    with pytest.raises(BoardError, match="3 to 40"):
        Board("chessboard", 2, 5, 0.03)
