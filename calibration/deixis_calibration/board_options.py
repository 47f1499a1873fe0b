"""Options that say which board it is."""

from __future__ import annotations

import argparse
import re

from deixis_cli.options import CommandError

from .boards import DICTIONARIES, Board, BoardError

MARKER_SHARE = 0.75


def add_board(parser: argparse.ArgumentParser) -> None:
    """What `board_of` reads. The defaults are a ChArUco board that fits an A4 or Letter sheet."""
    parser.add_argument("--pattern", choices=("charuco", "chessboard"), default="charuco", help="default: %(default)s")
    parser.add_argument(
        "--squares",
        default="7x5",
        metavar="COLUMNSxROWS",
        help="squares of the board, not inner corners (default: %(default)s)",
    )
    parser.add_argument("--square", type=float, default=0.036, metavar="METRES", help="side of a square (default: %(default)s)")
    parser.add_argument("--marker", type=float, metavar="METRES", help="charuco: side of a marker (default: 0.75 of a square)")
    parser.add_argument(
        "--dictionary", choices=sorted(DICTIONARIES), default="DICT_4X4_50", help="charuco: its markers (default: %(default)s)"
    )


def board_of(given: argparse.Namespace) -> Board:
    """The board that is described. Raises CommandError."""
    sides = re.fullmatch(r"(\d{1,3})x(\d{1,3})", given.squares.strip().lower())
    if sides is None:
        raise CommandError(f"--squares {given.squares}: not of the form 7x5")
    if given.pattern == "chessboard" and given.marker is not None:
        raise CommandError("--marker is for --pattern charuco")
    marker = 0.0 if given.pattern == "chessboard" else _marker_of(given)
    try:
        return Board(given.pattern, int(sides[1]), int(sides[2]), given.square, marker, given.dictionary)
    except BoardError as error:
        raise CommandError(str(error)) from None


def _marker_of(given: argparse.Namespace) -> float:
    return MARKER_SHARE * given.square if given.marker is None else float(given.marker)
