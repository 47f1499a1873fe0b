"""`deixis skin`: what the tracker takes for skin in pictures, before it has seen a face or learned the room.

Of each PICTURE it writes NAME.probability.png, P(skin) of each pixel (255: certain), and NAME.mask.png, 255 where skin is
likelier than not. Both are of the picture's size. A picture without colour says nothing of skin: both are
black then, as in the tracker.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from deixis_camera.folders import read_picture
from deixis_camera.pictures import Normaliser
from deixis_camera.sources import PictureRefused
from deixis_cli.options import CommandError, stage_settings
from deixis_schemas.messages import MAX_SIDE_PX
from deixis_tracker.config import TrackerConfig
from deixis_tracker.skin import SkinModel, is_grey
from numpy.typing import NDArray

from .core_config import core_config

PROBABILITY, MASK = "probability", "mask"
LIKELIER = 128
"""P(skin) of 255 from which skin is likelier than not."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("skin", help="what the tracker takes for skin in pictures", description=__doc__)
    parser.add_argument("pictures", nargs="+", type=Path, metavar="PICTURE", help="picture file")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder that gets NAME.probability.png and NAME.mask.png"
    )
    parser.add_argument(
        "--set", action="append", default=[], dest="sets", metavar="tracker.NAME=VALUE", help="override a setting: prior_skin"
    )
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Write both pictures of each. 0 when all were written, 1 when one was not. Raises CommandError."""
    model = SkinModel(_config(given.sets).prior_skin)
    outputs = outputs_of(given.pictures, given.out)
    try:
        given.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"--out {given.out}: {error.strerror}") from None
    failed = 0
    for path, written in zip(given.pictures, outputs, strict=True):
        try:
            _write(written, skin_of(path, model))
        except (PictureRefused, OSError) as error:
            print(f"deixis skin: '{path}': {error}", file=sys.stderr)
            failed += 1
    if failed:
        print(f"deixis skin: {failed} of {len(given.pictures)} pictures failed", file=sys.stderr)
    return 1 if failed else 0


def outputs_of(pictures: Sequence[Path], out: Path) -> list[dict[str, Path]]:
    """The files of each picture, by what they hold. Raises CommandError where two pictures, or one and a file, are the same."""
    twice = [name for name, count in Counter(path.stem for path in pictures).items() if count > 1]
    if twice:
        raise CommandError(f"'{twice[0]}': two pictures have this name; what is written of one would overwrite the other's")
    files = [{what: out / f"{path.stem}.{what}.png" for what in (PROBABILITY, MASK)} for path in pictures]
    for file in (file for of_picture in files for file in of_picture.values()):
        if any(file.exists() and picture.exists() and file.samefile(picture) for picture in pictures):
            raise CommandError(f"--out {out}: '{file.name}' there is one of the pictures, and would be overwritten")
    return files


def skin_of(path: Path, model: SkinModel) -> dict[str, NDArray[np.uint8]]:
    """P(skin) and mask (h, w) of a picture file. Raises PictureRefused."""
    picture = Normaliser(MAX_SIDE_PX).normalise(read_picture(path))
    coloured = picture if picture.ndim == 3 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
    grey = is_grey(coloured)
    probability = np.zeros(coloured.shape[:2], np.uint8) if grey else model.probability(coloured)
    return {PROBABILITY: probability, MASK: np.where(probability >= LIKELIER, 255, 0).astype(np.uint8)}


def _write(files: dict[str, Path], pictures: dict[str, NDArray[np.uint8]]) -> None:
    """Raises OSError."""
    for what, file in files.items():
        _, data = cv2.imencode(".png", pictures[what])
        file.write_bytes(data.tobytes())


def _config(sets: list[str]) -> TrackerConfig:
    given = stage_settings(sets)
    for stage in given:
        if stage != "tracker":
            raise CommandError(f"--set {stage}: skin is the tracker's; its settings alone matter here")
    return core_config("tracker", TrackerConfig, given)
