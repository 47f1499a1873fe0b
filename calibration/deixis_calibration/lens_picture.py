"""A measured lens as a picture: where boards were seen, how far off corners are, and the error of each picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from .coverage import ACROSS, DOWN, Coverage
from .lens_advice import tells_focal, told_tilt_deg
from .lens_fit import Fitted, LensFit

Canvas = NDArray[np.uint8]
Colour = tuple[int, int, int]
PANEL_PX, GAP_PX, TITLE_PX, BARS_PX, LINE_PX = 620, 20, 62, 190, 20
GROUND, PAPER, CELL, INK, FAINT = (32, 32, 32), (52, 52, 52), (96, 84, 62), (235, 235, 235), (150, 150, 150)
HULL, BAD = (200, 170, 90), (80, 80, 240)
FONT, LETTERS = cv2.FONT_HERSHEY_SIMPLEX, 0.5
SHIFT = 4
"""Bits of subpixel that lines and circles are drawn with."""
MAGNIFIED = (1, 2, 5, 10, 20, 50, 100, 200, 500)
ARROW_PX = 16.0
MOST_BARS = 80


def draw_lens(fit: LensFit, coverage: Coverage) -> Canvas:
    """The picture (h, w, 3), BGR."""
    width, height = fit.size
    high = round(PANEL_PX * height / width)
    canvas = np.full((TITLE_PX + high + LINE_PX + BARS_PX, 2 * PANEL_PX + 3 * GAP_PX, 3), GROUND, np.uint8)
    _write(canvas, _title(fit, coverage), (GAP_PX, 24))
    left = canvas[TITLE_PX : TITLE_PX + high, GAP_PX : GAP_PX + PANEL_PX]
    right = canvas[TITLE_PX : TITLE_PX + high, 2 * GAP_PX + PANEL_PX : 2 * GAP_PX + 2 * PANEL_PX]
    times = _magnification(fit.pictures, width)
    tilt_deg = told_tilt_deg(fit, coverage)
    said = f"where boards were seen: {100 * coverage.share:.0f} % of the picture, tilts up to {tilt_deg:.0f} deg apart"
    _write(canvas, said, (GAP_PX, 50), FAINT)
    _write(canvas, f"how far corners are off, {times} times as long", (2 * GAP_PX + PANEL_PX, 50), FAINT)
    _draw_coverage(left, fit, coverage)
    _draw_residuals(right, fit, times)
    _draw_bars(canvas[TITLE_PX + high + LINE_PX :], fit)
    return canvas


def write_picture(path: Path, canvas: Canvas) -> None:
    """Write a PNG. Raises OSError."""
    _, data = cv2.imencode(".png", canvas)
    path.write_bytes(data.tobytes())


def _title(fit: LensFit, coverage: Coverage) -> str:
    fx, fy, cx, cy = fit.matrix[0, 0], fit.matrix[1, 1], fit.matrix[0, 2], fit.matrix[1, 2]
    if not tells_focal(fit, coverage):
        return f"FOCAL LENGTH NOT DETERMINED: boards of one tilt. {fx:.1f}, {fy:.1f} px fits best, and may be many times off"
    return (
        f"error {fit.rms_px:.2f} px rms in {len(fit.pictures)} pictures of {fit.size[0]} x {fit.size[1]}; focal length "
        f"{fx:.1f}, {fy:.1f} px ({fit.horizontal_fov_deg:.1f} deg wide), axis at ({cx:.1f}, {cy:.1f}); {fit.model}"
    )


def _draw_coverage(panel: Canvas, fit: LensFit, coverage: Coverage) -> None:
    panel[:] = PAPER
    high, wide = panel.shape[:2]
    for row in range(DOWN):
        for column in range(ACROSS):
            top_left = column * wide // ACROSS + 1, row * high // DOWN + 1
            bottom_right = (column + 1) * wide // ACROSS - 2, (row + 1) * high // DOWN - 2
            if coverage.counts[row, column]:
                cv2.rectangle(panel, top_left, bottom_right, CELL, cv2.FILLED)
    scale = wide / fit.size[0]
    for picture in (*fit.pictures, *fit.odd):
        colour = BAD if picture in fit.odd else HULL
        hull = cv2.convexHull(picture.sighting.px)
        cv2.polylines(panel, [_at(hull, scale)], True, colour, 1, cv2.LINE_AA, SHIFT)
        for at in _at(picture.sighting.px, scale):
            cv2.circle(panel, at.tolist(), 2 << SHIFT, INK, cv2.FILLED, cv2.LINE_AA, SHIFT)


def _draw_residuals(panel: Canvas, fit: LensFit, times: int) -> None:
    panel[:] = PAPER
    scale = panel.shape[1] / fit.size[0]
    for picture in fit.pictures:
        ends = picture.sighting.px + times * picture.residual_px
        for start, end, off in zip(_at(picture.sighting.px, scale), _at(ends, scale), picture.residual_px, strict=True):
            cv2.line(panel, start.tolist(), end.tolist(), _heat(float(np.hypot(*off))), 1, cv2.LINE_AA, SHIFT)


def _draw_bars(strip: Canvas, fit: LensFit) -> None:
    """A bar for each picture; a line at the error of all."""
    shown = sorted((*fit.pictures, *fit.odd), key=lambda picture: picture.sighting.name)[:MOST_BARS]
    base, top = strip.shape[0] - 26, 26
    largest = max(1.0, *(picture.rms_px for picture in shown))
    _write(strip, "error of each picture, px rms (red: left out)", (GAP_PX, 14), FAINT)
    room = strip.shape[1] - 2 * GAP_PX - 44
    step = min(44, room // len(shown))
    for number, picture in enumerate(shown):
        x = GAP_PX + 44 + number * step
        y = base - round((base - top) * picture.rms_px / largest)
        cv2.rectangle(strip, (x, min(y, base - 1)), (x + max(1, step - 4), base), _colour(picture, fit), cv2.FILLED)
    for value in (0.0, fit.rms_px, largest):
        y = base - round((base - top) * value / largest)
        cv2.line(strip, (GAP_PX + 40, y), (strip.shape[1] - GAP_PX, y), FAINT, 1)
        if value in (0.0, largest) or 16 < y - top < base - top - 16:
            _write(strip, f"{value:.2g}", (GAP_PX, y + 5), FAINT)
    _write(strip, f"{shown[0].sighting.name} ... {shown[-1].sighting.name}", (GAP_PX + 44, strip.shape[0] - 8), FAINT)


def _colour(picture: Fitted, fit: LensFit) -> Colour:
    return BAD if picture in fit.odd else _heat(picture.rms_px)


def _heat(error_px: float) -> Colour:
    """From green over yellow to red at a pixel."""
    share = min(1.0, error_px)
    return 60, round(min(1.0, 2 - 2 * share) * 220), round(min(1.0, 2 * share) * 240)


def _magnification(pictures: Sequence[Fitted], width: int) -> int:
    """So that nearly all lines are short of ARROW_PX."""
    lengths = np.linalg.norm(np.concatenate([picture.residual_px for picture in pictures]), axis=1) * PANEL_PX / width
    usual = max(1e-9, float(np.quantile(lengths, 0.9)))
    return max((times for times in MAGNIFIED if times * usual <= ARROW_PX), default=1)


def _at(px: NDArray, scale: float) -> NDArray[np.int32]:
    """Points of the camera's picture (n, 2) on a panel, with SHIFT bits of subpixel."""
    return np.asarray(np.rint(px.reshape(-1, 2) * scale * (1 << SHIFT)), np.int32)


def _write(canvas: Canvas, text: str, at: tuple[int, int], colour: Colour = INK) -> None:
    cv2.putText(canvas, text, at, FONT, LETTERS, colour, 1, cv2.LINE_AA)
