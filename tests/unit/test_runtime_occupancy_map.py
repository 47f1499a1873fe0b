"""Walls from a ROS map as map_saver writes it, unchanged, and as lines and polygons of the site file."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from deixis_runtime.occupancy_map import map_lines, wall_lines
from deixis_runtime.site import SiteError, load_site

# As map_saver writes them: free light, unknown 205, occupied 0.
FREE, UNKNOWN, OCCUPIED = 254, 205, 0
YAML = """image: hall.pgm
mode: trinary
resolution: 0.05
origin: [-2, -1, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""


def hall() -> np.ndarray:
    """A hall of 6 x 4 m with a wall of one cell around it, unknown outside; a partition of three cells, and specks."""
    cells = np.full((100, 140), UNKNOWN, np.uint8)
    cells[10:90, 10:130] = FREE
    for rows, columns in ((10, slice(10, 130)), (89, slice(10, 130)), (slice(10, 90), 10), (slice(10, 90), 129)):
        cells[rows, columns] = OCCUPIED
    cells[10:50, 69:72] = OCCUPIED
    cells[70, 40] = cells[72:75, 100:103] = OCCUPIED
    return cells


def written(folder: Path, cells: np.ndarray, yaml: str = YAML) -> Path:
    header = f"P5\n# CREATOR: map_saver.cpp 0.050 m/pix\n{cells.shape[1]} {cells.shape[0]}\n255\n"
    (folder / "hall.pgm").write_bytes(header.encode() + cells.tobytes())
    (folder / "hall.yaml").write_text(yaml)
    return folder / "hall.yaml"


def test_a_map_becomes_few_lines_where_its_walls_are(tmp_path):
    lines = map_lines(written(tmp_path, hall()))
    assert len(lines) <= 16
    ends = np.array(lines)
    # Cells of 0.05 m from (-2, -1): the hall reaches from column 10 to 129 and, from below, from row 10 to 89.
    assert ends[..., 0].min() == pytest.approx(-2 + 10.5 * 0.05)
    assert ends[..., 0].max() == pytest.approx(-2 + 129.5 * 0.05)
    assert ends[..., 1].min() == pytest.approx(-1 + 10.5 * 0.05)
    assert ends[..., 1].max() == pytest.approx(-1 + 89.5 * 0.05)
    # The partition hangs from the upper wall, in the middle.
    beside = [line for line in lines if all(abs(x - (-2 + 70.5 * 0.05)) < 0.08 for x, _ in line)]
    assert min(y for line in beside for _, y in line) == pytest.approx(-1 + 50.5 * 0.05, abs=0.03)
    # The outer wall has two faces, also where they are one cell; so has the partition.
    length = sum(math.dist(*line) for line in lines)
    assert length == pytest.approx(2 * 2 * (5.95 + 3.95) + 2 * 2, abs=0.5)


def test_the_origins_yaw_turns_the_map(tmp_path):
    plain = np.array(map_lines(written(tmp_path, hall())))
    turned = np.array(map_lines(written(tmp_path, hall(), YAML.replace("[-2, -1, 0]", "[-2, -1, 1.5707963]"))))
    x, y = plain[..., 0] + 2, plain[..., 1] + 1
    assert turned == pytest.approx(np.stack([-2 - y, -1 + x], axis=-1), abs=1e-6)


def test_negate_raw_and_png_are_read_as_map_server_does(tmp_path):
    expected = map_lines(written(tmp_path, hall()))
    assert map_lines(written(tmp_path, 255 - hall(), YAML.replace("negate: 0", "negate: 1"))) == expected
    # Scaled maps tell how likely what is between free and occupied is; what is occupied is the same.
    assert map_lines(written(tmp_path, hall(), YAML.replace("trinary", "scale"))) == expected
    raw = np.where(hall() == OCCUPIED, 100, np.where(hall() == FREE, 0, 255)).astype(np.uint8)
    assert map_lines(written(tmp_path, raw, YAML.replace("trinary", "raw"))) == expected
    cv2.imwrite(str(tmp_path / "hall.png"), hall())
    (tmp_path / "hall.yaml").write_text(YAML.replace("hall.pgm", "hall.png").replace("mode: trinary\n", "lethal: 1\n"))
    assert map_lines(tmp_path / "hall.yaml") == expected


def pgm(cells: np.ndarray, most: int, text: bool = False) -> bytes:
    """The same shades, of which that value is white; as bytes or as text with comments in it."""
    shades = np.rint(cells * (most / 255)).astype(">u2" if most > 255 else np.uint8)
    kind = b"P2" if text else b"P5"
    header = kind + b"\n# made by hand\n%d # wide\n%d\n%d\n" % (*cells.shape[::-1], most)
    lines = [f"# row {i}\n{' '.join(map(str, row))}\n" for i, row in enumerate(shades)]
    return header + ("".join(lines).encode() if text else shades.tobytes())


@pytest.mark.parametrize("text", [False, True])
@pytest.mark.parametrize("most", [1, 15, 100, 255, 1000, 65535])
def test_a_map_is_read_by_its_largest_value_in_bytes_or_in_text(tmp_path, most, text):
    expected = map_lines(written(tmp_path, hall()))
    (tmp_path / "hall.pgm").write_bytes(pgm(hall(), most, text))
    assert map_lines(tmp_path / "hall.yaml") == expected


def test_sixteen_bits_of_png_are_read_as_eight(tmp_path):
    expected = map_lines(written(tmp_path, hall()))
    cv2.imwrite(str(tmp_path / "hall.png"), hall().astype(np.uint16) * 257)
    (tmp_path / "hall.yaml").write_text(YAML.replace("hall.pgm", "hall.png"))
    assert map_lines(tmp_path / "hall.yaml") == expected


@pytest.mark.parametrize(
    ("packed", "complaint"),
    [
        (pgm(hall(), 255)[:-1], "cut off: 13999 of 14000 cells"),
        (pgm(hall(), 255, text=True)[:-4], "cut off"),
        (b"P5\n4 4\n0\n" + bytes(16), "largest value is 0"),
        (b"P5\n4 4\n70000\n" + bytes(32), "largest value is 70000"),
        (b"P5\n4 4\n100\n" + bytes([200] * 16), "a cell is 200, beyond its largest value 100"),
        (b"P5\n0 4\n255\n", "0 x 4"),
        (b"P5\nwide\n", "header"),
        (b"P2\n2 2\n255\n1 2 x 4\n", "not numbers"),
        (b"P2\n2 2\n255\n1 2 3 -4\n", "beyond"),
    ],
)
def test_a_pgm_that_is_damaged_is_refused_in_words(tmp_path, packed, complaint):
    path = written(tmp_path, hall())
    (tmp_path / "hall.pgm").write_bytes(packed)
    with pytest.raises(SiteError, match=complaint) as error:
        map_lines(path)
    assert "hall.yaml" in str(error.value)
    assert "image" in str(error.value)


@pytest.mark.parametrize(
    ("yaml", "complaint"),
    [
        (YAML.replace("hall.pgm", "none.pgm"), r"image: .*none\.pgm: No such file"),
        (YAML.replace("hall.pgm", "hall.yaml"), r"image: .*hall\.yaml is not a picture"),
        (YAML.replace("0.05", "0"), "resolution"),
        (YAML.replace("[-2, -1, 0]", "[-2, -1]"), "origin"),
        (YAML.replace("[-2, -1, 0]", "[1.0e+300, -1, 0]"), r"origin\.0"),
        (YAML.replace("trinary", "guess"), "mode"),
        ("- 1", "not a mapping"),
    ],
)
def test_a_map_that_cannot_be_read_is_named(tmp_path, yaml, complaint):
    with pytest.raises(SiteError, match=complaint) as error:
        map_lines(written(tmp_path, hall(), yaml))
    assert "hall.yaml" in str(error.value)


def test_a_map_of_noise_is_refused(tmp_path):
    noise = np.kron(np.indices((400, 400)).sum(axis=0) % 2, np.ones((9, 7))).astype(np.uint8) * FREE
    with pytest.raises(SiteError, match="lines, more than 20000"):
        map_lines(written(tmp_path, np.roll(noise, 3) & np.roll(noise, 2, axis=1)))


def test_a_site_has_lines_polygons_and_the_map_beside_it(tmp_path):
    written(tmp_path, hall())
    site = tmp_path / "site.yaml"
    site.write_text("walls:\n- [[0, 0], [1, 0]]\n- [[5, 5], [6, 5], [6, 6]]\nmap: hall.yaml\n")
    lines = wall_lines(load_site(site))
    assert lines[:4] == [((0, 0), (1, 0)), ((5, 5), (6, 5)), ((6, 5), (6, 6)), ((6, 6), (5, 5))]
    assert lines[4:] == map_lines(tmp_path / "hall.yaml")


def test_a_wall_of_one_end_is_refused(tmp_path):
    site = tmp_path / "site.yaml"
    site.write_text("walls: [[[0, 0]]]")
    with pytest.raises(SiteError, match=r"walls\.0"):
        load_site(site)
