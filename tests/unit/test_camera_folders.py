"""Folders of pictures."""

import re
import struct
import zlib
from pathlib import Path
from random import Random

import cv2
import numpy as np
import pytest
from deixis_camera.capture import source_for
from deixis_camera.config import CameraConfig
from deixis_camera.folders import Pictures, natural_order, picture_files, read_picture
from deixis_camera.sources import Picture, PictureRefused, SourceRefused
from hypothesis import given
from hypothesis import strategies as st


def write_picture(path: Path, level: int = 100, size: tuple[int, int] = (80, 60)) -> Path:
    assert cv2.imwrite(str(path), np.full((size[1], size[0], 3), level, np.uint8))
    return path


def read_all(pictures: Pictures) -> list[Picture | str]:
    """Pictures in order; for one that was refused what was said."""
    pictures.open()
    found: list[Picture | str] = []
    while True:
        try:
            picture = pictures.read()
        except PictureRefused as error:
            found.append(str(error))
            continue
        if picture is None:
            return found
        found.append(picture)


def test_pictures_come_in_the_natural_order_of_their_names(tmp_path: Path) -> None:
    for name in ("f10.png", "f2.png", "F1.PNG", "f1b.png", "f.txt", ".hidden.png"):
        write_picture(tmp_path / name) if name.lower().endswith("png") else (tmp_path / name).write_text("no picture")
    assert [path.name for path in picture_files(tmp_path)] == ["F1.PNG", "f1b.png", "f2.png", "f10.png"]


@given(st.lists(st.text(alphabet="ab019_.٣²", max_size=6), max_size=12), st.randoms(use_true_random=False))
def test_natural_order_sorts_any_names_the_same_way_whatever_their_first_order(names: list[str], random: Random) -> None:
    shuffled = names.copy()
    random.shuffle(shuffled)
    assert sorted(names, key=natural_order) == sorted(shuffled, key=natural_order)


def test_a_folder_plays_at_five_pictures_a_second_or_as_asked(tmp_path: Path) -> None:
    for index in range(3):
        write_picture(tmp_path / f"{index}.jpg")
    for rate_hz, period_ns in ((None, 200_000_000), (10.0, 100_000_000)):
        pictures = [picture for picture in read_all(Pictures(tmp_path, rate_hz)) if isinstance(picture, Picture)]
        assert [picture.time_ns for picture in pictures] == [0, period_ns, 2 * period_ns]


def test_an_unreadable_picture_among_good_ones_is_refused_alone_and_keeps_its_number(tmp_path: Path) -> None:
    write_picture(tmp_path / "1.png")
    (tmp_path / "2.png").write_bytes(b"not a picture")
    (tmp_path / "3.png").write_bytes(b"")
    good = (tmp_path / "1.png").read_bytes()
    (tmp_path / "4.png").write_bytes(good[:40])
    write_picture(tmp_path / "5.png")
    write_picture(tmp_path / "whole.jpg")
    (tmp_path / "6.jpg").write_bytes((tmp_path / "whole.jpg").read_bytes()[:-2])
    (tmp_path / "whole.jpg").unlink()
    found = read_all(Pictures(tmp_path))
    assert [item.seq for item in found if isinstance(item, Picture)] == [0, 4]
    said = [item for item in found if isinstance(item, str)]
    assert [text.split("'")[1] for text in said] == ["2.png", "3.png", "4.png", "6.jpg"]
    assert "is empty" in said[1]
    assert "is cut off" in said[3]


def test_depth_and_channels_of_a_picture_are_kept_for_the_normaliser(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((70, 90), 9, np.uint8))
    cv2.imwrite(str(tmp_path / "deep.png"), np.full((70, 90, 3), 40_000, np.uint16))
    deep, grey = (picture.image for picture in read_all(Pictures(tmp_path)) if isinstance(picture, Picture))
    assert (grey.shape, grey.dtype.name) == ((70, 90), "uint8")
    assert (deep.shape, deep.dtype.name) == ((70, 90, 3), "uint16")


def test_a_folder_without_pictures_is_refused_and_its_files_counted(tmp_path: Path) -> None:
    with pytest.raises(SourceRefused, match="it is empty"):
        Pictures(tmp_path).open()
    (tmp_path / "readme.md").write_text("x")
    with pytest.raises(SourceRefused, match="none of its 1 files is one"):
        Pictures(tmp_path).open()


def test_a_single_picture_is_a_recording_of_one_frame(tmp_path: Path) -> None:
    source = source_for(CameraConfig(source=str(write_picture(tmp_path / "one.jpg"))))
    assert isinstance(source, Pictures)
    assert [picture.seq for picture in read_all(source) if isinstance(picture, Picture)] == [0]


def claimed_size(data: bytes, width: int, height: int) -> bytes:
    """A JPEG or PNG of 80 x 60 as it would be if its header claimed another size."""
    if data.startswith(b"\xff\xd8"):
        old, new = (struct.pack(">HH", *size) for size in ((60, 80), (height, width)))
        return data.replace(old, new, 1)
    old, new = (struct.pack(">II", *size) for size in ((80, 60), (width, height)))
    head = data[:8] + data[8:33].replace(old, new, 1)
    return head[:29] + struct.pack(">I", zlib.crc32(head[12:29])) + data[33:]


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
@pytest.mark.parametrize("size", [(8193, 60), (80, 8193), (30000, 30000), (65535, 100)])
def test_a_picture_that_claims_to_be_huge_is_refused_before_it_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, size: tuple[int, int]
) -> None:
    path = write_picture(tmp_path / f"bomb{suffix}")
    path.write_bytes(claimed_size(path.read_bytes(), *size))
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("it was decoded"))
    said = f"picture 'bomb{suffix}' is too large: {size[0]} x {size[1]}, at most 8192 pixels a side are taken"
    with pytest.raises(PictureRefused, match=f"^{re.escape(said)}$"):
        read_picture(path)


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_a_picture_of_the_largest_size_is_decoded(tmp_path: Path, suffix: str) -> None:
    assert read_picture(write_picture(tmp_path / f"wide{suffix}", size=(8192, 64))).shape == (64, 8192, 3)


def test_the_size_of_a_jpeg_is_not_that_of_its_thumbnail(tmp_path: Path) -> None:
    path = write_picture(tmp_path / "small.jpg")
    thumbnail = claimed_size(path.read_bytes(), 30000, 30000)
    data = write_picture(tmp_path / "photo.jpg").read_bytes()
    segment = b"\xff\xe1" + struct.pack(">H", 2 + len(thumbnail)) + thumbnail
    path.write_bytes(data[:2] + segment + b"\xff\xff" + data[2:])
    assert read_picture(path).shape == (60, 80, 3), "also with fill bytes before a marker"
