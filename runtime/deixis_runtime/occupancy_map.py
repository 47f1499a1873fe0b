"""Walls of a site: those written in it, and the outlines of what its ROS map (`map_server` YAML and picture) shows as occupied.

Of the map everything is read as `map_server` reads it: resolution, origin, negate, occupied_thresh and mode. Extra `images`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import cv2
import numpy as np
import numpy.typing as npt
from deixis_schemas.codec import say
from deixis_schemas.messages import Metre
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .pgm import PgmError, Picture, is_pgm, read_pgm
from .site import Site, SiteError, WallLine, read_yaml

MAX_MAP_SIDE = 16_384
MAX_PICTURE_BYTES = 300 << 20
MAX_LINES = 20_000
# What is smaller across is a leg of a chair or a speck of the scanner: nobody is hidden from what lies beyond it.
LEAST_M = 0.3
# An outline is drawn with as few lines as stay within this of it, or within a cell where cells are larger.
WITHIN_M = 0.05
UNKNOWN_SHADE = 205

Mask = npt.NDArray[np.uint8]


class MapFile(BaseModel):
    """What a `map_server` YAML says. Keys that newer versions add are left alone."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    image: Annotated[str, Field(min_length=1, max_length=4096)]
    resolution: float = Field(gt=0, le=10, description="Metres a cell.")
    origin: tuple[Metre, Metre, float] = Field(
        description="Of the lower left corner in the map: x, y in metres, yaw in radians."
    )
    negate: bool = Field(default=False, description="Light is occupied, dark is free.")
    occupied_thresh: float = Field(gt=0, le=1, description="Cells are occupied from this probability.")
    mode: Literal["trinary", "scale", "raw"] = "trinary"


def wall_lines(site: Site) -> list[WallLine]:
    """All walls of a site as lines in the map frame, metres. Raises SiteError where its map cannot be read."""
    return site.wall_lines + (map_lines(site.path.parent / site.map) if site.map else [])


def map_lines(path: Path) -> list[WallLine]:
    """The outlines of all that is occupied in a map, as lines. Raises SiteError with file, key and cause."""
    described, picture = read_map(path)
    lines = outlines(_occupied(picture, described), described)
    if len(lines) > MAX_LINES:
        raise SiteError(f"map {path}: its outlines have {len(lines)} lines, more than {MAX_LINES}: too ragged to see past")
    return lines


def read_map(path: Path) -> tuple[MapFile, Picture]:
    """What a map's YAML says, and its picture. Raises SiteError with file, key and cause."""
    try:
        described = MapFile.model_validate(read_yaml(path, "map"))
    except ValidationError as error:
        raise SiteError(f"map {path}: {say(error)}") from None
    return described, _picture(path, path.parent / described.image)


def shades(picture: Picture, described: MapFile) -> Mask:
    """The map (h, w) as people know it, whatever way it is saved: free is light, occupied dark, the unknown grey between."""
    values = np.arange(picture.most + 1) * (255 / picture.most)
    if described.mode == "raw":
        light = np.where(np.rint(values) <= 100, 255 - 2.55 * np.rint(values), UNKNOWN_SHADE)
    else:
        light = 255 - values if described.negate else values
    return np.asarray(np.rint(light).clip(0, 255).astype(np.uint8)[picture.cells])


def outlines(occupied: Mask, described: MapFile) -> list[WallLine]:
    """The outlines of what is occupied, not 0, in cells (h, w) from above: lines in the map frame."""
    cell_m = described.resolution
    # Both faces of a wall, for POIs hang on either. Corner to corner counts as together: a wall that runs aslant is one.
    contours, _ = cv2.findContours(occupied, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    found: dict[tuple[tuple[int, int], tuple[int, int]], None] = {}
    for contour in contours:
        if (np.ptp(contour[:, 0], axis=0).max() + 1) * cell_m < LEAST_M:
            continue
        corners = cv2.approxPolyDP(contour, max(1.0, WITHIN_M / cell_m), True)[:, 0]
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            one, other = sorted([(int(start[0]), int(start[1])), (int(end[0]), int(end[1]))])
            # There and back along a wall of one cell is one line.
            found[one, other] = None
    height = len(occupied)
    return [(_in_map(start, height, described), _in_map(end, height, described)) for start, end in found]


def _in_map(cell: tuple[int, int], height: int, described: MapFile) -> tuple[float, float]:
    """The middle of a cell (column, row from above) in the map frame."""
    x, y, yaw = described.origin
    right, up = (cell[0] + 0.5) * described.resolution, (height - cell[1] - 0.5) * described.resolution
    cos, sin = math.cos(yaw), math.sin(yaw)
    return x + right * cos - up * sin, y + right * sin + up * cos


def _occupied(picture: Picture, described: MapFile) -> Mask:
    # As `map_server` does: whatever the picture's largest value is, that is white.
    values = np.arange(picture.most + 1) * (255 / picture.most)
    if described.mode == "raw":
        # Percent as they are; above 100 nothing is known.
        probability = np.where(np.rint(values) <= 100, np.rint(values) / 100, 0.0)
    else:
        probability = (values if described.negate else 255 - values) / 255
    return np.asarray((probability > described.occupied_thresh).astype(np.uint8)[picture.cells])


def _picture(path: Path, image: Path) -> Picture:
    try:
        if image.stat().st_size > MAX_PICTURE_BYTES:
            raise SiteError(f"map {path}: image: {image} is larger than {MAX_PICTURE_BYTES} bytes")
        packed = image.read_bytes()
    except OSError as error:
        raise SiteError(f"map {path}: image: {image}: {error.strerror}") from None
    try:
        picture = read_pgm(packed) if is_pgm(packed) else _decoded(packed)
    except PgmError as error:
        raise SiteError(f"map {path}: image: {image}: {error}") from None
    if picture is None:
        raise SiteError(f"map {path}: image: {image} is not a picture (PGM, PNG, BMP)")
    height, width = picture.cells.shape
    if max(height, width) > MAX_MAP_SIDE:
        raise SiteError(f"map {path}: image: {image} is {width} x {height}, at most {MAX_MAP_SIDE} a side")
    return picture


def _decoded(packed: bytes) -> Picture | None:
    try:
        cells: Any = (
            cv2.imdecode(np.frombuffer(packed, np.uint8), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH) if packed else None
        )
    except cv2.error:
        return None
    return None if cells is None or cells.dtype.kind != "u" else Picture(cells, np.iinfo(cells.dtype).max)
