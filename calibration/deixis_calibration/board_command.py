"""`deixis calibrate board`: a board to print, as PNG or PDF of its true size."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from deixis_cli.options import CommandError
from PIL import Image

from .board_options import add_board, board_of
from .boards import Board

DPI = 300
MARGIN_M = 0.01
"""White around the squares: without it the outer markers are not found."""
METRES_PER_INCH = 0.0254


def register(parts: Any) -> None:
    """Add the command."""
    parser = parts.add_parser("board", help="make a board to print", description=__doc__)
    add_board(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="board.png or board.pdf")
    parser.add_argument("--force", action="store_true", help="write over a file that is there")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Write the board. Raises CommandError."""
    board = board_of(given)
    if given.out.suffix.lower() not in (".png", ".pdf"):
        raise CommandError(f"--out {given.out}: '.png' or '.pdf' can be written")
    if given.out.exists() and not given.force:
        raise CommandError(f"--out {given.out}: is there already; --force writes over it")
    picture = sheet_of(board)
    try:
        picture.save(given.out, dpi=(DPI, DPI), resolution=DPI)
    except OSError as error:
        raise CommandError(f"--out {given.out}: {error.strerror or error}") from None
    width_mm, height_mm = (1000 * side for side in board.size_m)
    print(f"{given.out}: {board}; {width_mm:.0f} x {height_mm:.0f} mm without its white margin")
    print("Print it at 100 % (not 'fit to page'), glue it onto something flat, and measure a square with a ruler:")
    print(f"if it is not {1000 * board.square_m:g} mm, give what you measured as --square to 'deixis calibrate camera'.")
    return 0


def sheet_of(board: Board) -> Image.Image:
    """The board with a white margin, at DPI. Raises CommandError for one larger than a poster."""
    square_px = round(board.square_m / METRES_PER_INCH * DPI)
    if max(board.size_m) > 2.5:
        raise CommandError(f"a board of {board.size_m[0]:.2f} x {board.size_m[1]:.2f} m is larger than can be printed (2.5 m)")
    squares = Image.fromarray(board.draw(square_px))
    margin = round(MARGIN_M / METRES_PER_INCH * DPI)
    sheet = Image.new("L", (squares.width + 2 * margin, squares.height + 2 * margin), 255)
    sheet.paste(squares, (margin, margin))
    return sheet
