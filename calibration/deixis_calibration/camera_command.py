"""`deixis calibrate camera`: the camera's lens from pictures of a board, as a ROS camera_info YAML and a picture of its errors.

Exit status: 0 when the lens was measured, 3 when it was and is not to be trusted (an error above a
pixel, or a focal length that is not determined, for all boards had one tilt), 130 when stopped (what was seen until
then is measured and written all the same).
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from deixis_camera.calibration import CalibrationError
from deixis_cli.options import CommandError, add_connect
from deixis_runtime.interrupts import Interrupts
from deixis_runtime.settings import checked_name
from rich.console import Console

from .album import Album
from .board_options import add_board, board_of
from .boards import Board
from .camera_info_file import write_camera_info
from .coverage import Coverage, cover
from .gathering import gather
from .lens_advice import LARGE_ERROR_PX, advice, tells_focal, told_tilt_deg
from .lens_fit import MODELS, LensFit, LensFitError, fit_lens
from .lens_picture import draw_lens, write_picture
from .picture_sources import PictureSource, open_camera_stage, open_source
from .sightings import finder_of

MOST_NAMED = 5
POOR, STOPPED = 3, 130


def register(parts: Any) -> None:
    """Add the command."""
    parser = parts.add_parser("camera", help="measure the lens from pictures of a board", description=__doc__)
    parser.add_argument(
        "sources",
        nargs="*",
        metavar="SOURCE",
        help="picture files and folders, or one video, camera (0, /dev/video0) or URL; none with --robot",
    )
    parser.add_argument(
        "--robot", type=checked_name, metavar="NAME", help="take the frames of this robot's running camera stage"
    )
    add_connect(parser)
    add_board(parser)
    parser.add_argument(
        "--model", choices=MODELS, default="plumb_bob", help="distortion: equidistant for a fisheye (default: %(default)s)"
    )
    parser.add_argument("--out", type=Path, default=Path("camera.yaml"), metavar="FILE", help="default: %(default)s")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="the picture (default: beside --out)")
    parser.add_argument("--name", default="camera", help="camera_name in the file (default: %(default)s)")
    parser.add_argument("--force", action="store_true", help="write over files that are there")
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Look, measure, write. Raises CommandError or Unreachable."""
    board, console = board_of(given), Console(stderr=True)
    if bool(given.sources) == bool(given.robot):
        raise CommandError("give SOURCE, or --robot NAME for the frames of a running camera stage")
    picture = given.picture or given.out.with_suffix(".png")
    _check_outputs(given.out, picture, given.force)
    with Interrupts() as interrupts:
        with _opened(given, interrupts) as source:
            album = Album(board, only_new=source.moving, only_still=source.live)
            gather(source, finder_of(board), album, interrupts, console)
        stopped = interrupts.requested() and not source.live
    if not album.kept:
        raise CommandError(_none_found(board, album, source))
    try:
        with console.status(f"measuring the lens from {len(album.kept)} pictures ..."):
            fit = fit_lens(board, album.kept, given.model)
    except LensFitError as error:
        raise CommandError(f"{error}{_refused_text(album)}") from None
    coverage = cover(board, [fitted.sighting for fitted in fit.pictures])
    warnings = advice(fit, coverage)
    _write(given, picture, board, fit, coverage, warnings)
    document = _document(board, fit, coverage, warnings, album)
    print(json.dumps(document) if given.json else _text(given, picture, fit, coverage, warnings, album))
    if stopped:
        return STOPPED
    return 0 if fit.rms_px <= LARGE_ERROR_PX and tells_focal(fit, coverage) else POOR


def _opened(given: argparse.Namespace, interrupts: Interrupts) -> AbstractContextManager[PictureSource]:
    if given.robot:
        return open_camera_stage(given.robot, given.connect, interrupts)
    return open_source(given.sources, interrupts)


def _check_outputs(out: Path, picture: Path, force: bool) -> None:
    """Before an hour of work. Raises CommandError."""
    if out.resolve() == picture.resolve():
        raise CommandError(f"--picture {picture}: is the file of the lens itself")
    for option, path in (("--out", out), ("--picture", picture)):
        if path.exists() and not force:
            raise CommandError(f"{option} {path}: is there already; --force writes over it")
        if not path.parent.is_dir():
            raise CommandError(f"{option} {path}: there is no folder '{path.parent}'")


def _none_found(board: Board, album: Album, source: PictureSource) -> str:
    looked = f"the {board} was found in none of {len(album.refused)} pictures of {source.name}"
    return f"{looked}: are --pattern, --squares and --dictionary right, is it lit and in focus?{_refused_text(album)}"


def _refused_text(album: Album) -> str:
    """Pictures that were not used and why, the commonest cause first; empty where there are none."""
    causes = Counter(album.refused.values()).most_common(3)
    return "".join(f"\n  {count} of them: {why}{_names(album, why)}" for why, count in causes)


def _names(album: Album, why: str) -> str:
    names = [name for name, cause in album.refused.items() if cause == why]
    return f" ({', '.join(names[:MOST_NAMED])}{', ...' if len(names) > MOST_NAMED else ''})"


def _write(
    given: argparse.Namespace, picture: Path, board: Board, fit: LensFit, coverage: Coverage, warnings: list[str]
) -> None:
    """Raises CommandError."""
    remarks = [
        f"Measured by 'deixis calibrate camera': {board}",
        f"error {fit.rms_px:.3f} px rms over {len(fit.pictures)} pictures; boards covered {100 * coverage.share:.0f} % of it",
        *(f"warning: {warning}" for warning in warnings),
    ]
    try:
        write_camera_info(given.out, fit, given.name, remarks)
        write_picture(picture, draw_lens(fit, coverage))
    except CalibrationError as error:
        raise CommandError(f"what was measured is no lens that the camera stage takes: {error}") from None
    except OSError as error:
        raise CommandError(f"'{error.filename or given.out}' cannot be written: {error.strerror or error}") from None


def _text(given: argparse.Namespace, picture: Path, fit: LensFit, coverage: Coverage, warnings: list[str], album: Album) -> str:
    worst = max(fit.pictures, key=lambda fitted: fitted.rms_px)
    unused = _refused_text(album)
    return "\n".join(
        [
            f"error {fit.rms_px:.2f} px rms over {len(fit.pictures)} pictures; the worst has {worst.rms_px:.2f}: "
            + worst.sighting.name,
            f"{_focal_text(fit, coverage)}; {fit.model} " + " ".join(f"{value:.4f}" for value in fit.distortion),
            f"boards covered {100 * coverage.share:.0f} % of the picture, at tilts up to "
            f"{told_tilt_deg(fit, coverage):.0f} degrees apart",
            *([f"not used:{unused}"] if unused else []),
            *(f"warning: {warning}" for warning in warnings),
            f"{given.out}: name it in the site file, as camera.calibration; {picture}: how good it is",
        ]
    )


def _focal_text(fit: LensFit, coverage: Coverage) -> str:
    focal_px = f"{fit.matrix[0, 0]:.1f} px"
    if not tells_focal(fit, coverage):
        return f"focal length not determined: all boards had one tilt; {focal_px} fits best, and may be many times off"
    known = "" if fit.focal_sigma is None else f" +- {100 * fit.focal_sigma:.2f} %"
    return f"focal length {focal_px}{known}, {fit.horizontal_fov_deg:.1f} degrees wide"


def _document(board: Board, fit: LensFit, coverage: Coverage, warnings: list[str], album: Album) -> dict[str, Any]:
    pictures = {fitted.sighting.name: {"rms_px": fitted.rms_px, "used": True} for fitted in fit.pictures}
    odd = {fitted.sighting.name: {"rms_px": fitted.rms_px, "used": False} for fitted in fit.odd}
    return {
        "board": str(board),
        "width": fit.size[0],
        "height": fit.size[1],
        "model": fit.model,
        "camera_matrix": fit.matrix.ravel().tolist(),
        "distortion": list(fit.distortion),
        "rms_px": fit.rms_px,
        "focal_determined": tells_focal(fit, coverage),
        "focal_sigma": fit.focal_sigma if tells_focal(fit, coverage) else None,
        "coverage": coverage.share,
        "tilt_deg": told_tilt_deg(fit, coverage),
        "pictures": {**pictures, **odd},
        "refused": album.refused,
        "warnings": warnings,
    }
