"""PGM pictures, as maps are saved in: binary (P5) or as text (P2), of 8 or 16 bits, whatever their largest value is."""

from __future__ import annotations

import re
import warnings
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

MOST = 65_535
_APART = rb"(?:\s|#[^\n]*\n)+"
_HEADER = re.compile(rb"P[25]" + _APART + rb"(\d{1,6})" + _APART + rb"(\d{1,6})" + _APART + rb"(\d{1,6})(?:#[^\n]*)?\s")
_COMMENT = re.compile(rb"#[^\n]*")


class PgmError(ValueError):
    """A picture that begins as PGM does and is none; the text says what is wrong."""


class Picture(NamedTuple):
    """Grey values (h, w), 0 is black and `most` is white."""

    cells: npt.NDArray[np.integer]
    most: int


def is_pgm(packed: bytes) -> bool:
    """Whether a file begins as PGM does."""
    return packed[:2] in (b"P2", b"P5")


def read_pgm(packed: bytes) -> Picture:
    """The picture of a file's bytes. Raises PgmError."""
    header = _HEADER.match(packed)
    if header is None:
        raise PgmError("its header is not that of PGM: width, height and largest value")
    width, height, most = (int(number) for number in header.groups())
    if not 0 < most <= MOST:
        raise PgmError(f"its largest value is {most}, not 1 to {MOST}")
    if not width or not height:
        raise PgmError(f"it is {width} x {height} cells")
    body = packed[header.end() :]
    values = _numbers(body) if packed[:2] == b"P2" else _bytes(body, width * height, most)
    if len(values) < width * height:
        raise PgmError(f"it is cut off: {len(values)} of {width * height} cells")
    cells = values[: width * height].reshape(height, width)
    if cells.max() > most or cells.min() < 0:
        raise PgmError(f"a cell is {cells.max() if cells.max() > most else cells.min()}, beyond its largest value {most}")
    return Picture(cells, most)


def _bytes(body: bytes, count: int, most: int) -> npt.NDArray[np.integer]:
    kind = np.dtype(np.uint8 if most < 256 else ">u2")
    return np.frombuffer(body, kind, min(count, len(body) // kind.itemsize))


def _numbers(body: bytes) -> npt.NDArray[np.integer]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(_COMMENT.sub(b"", body).decode("ascii"), np.int32, sep=" ")
        except (ValueError, DeprecationWarning):
            raise PgmError("its cells are not numbers") from None
