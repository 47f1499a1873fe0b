"""What the tracker sees, drawn: the frame with face and hands, beside it what passes for skin, below it what is to be said."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import cv2
import numpy as np
from deixis_runtime.finding import Finding, Level
from deixis_schemas.messages import Track
from numpy.typing import NDArray

from .looking import LIKELIER, Seen

Canvas = NDArray[np.uint8]
Colour = tuple[int, int, int]
COLOURS: dict[str, Colour] = {
    "face": (80, 220, 80),
    "left_hand": (230, 160, 40),
    "right_hand": (60, 120, 250),
    "unknown": (170, 170, 170),
}
NAMES = {"face": "face", "left_hand": "left hand", "right_hand": "right hand", "unknown": "unknown"}
LEVELS: dict[Level, Colour] = {"ok": (80, 220, 80), "note": (60, 200, 240), "wrong": (80, 80, 240)}
GROUND, INK, BLACK = (32, 32, 32), (235, 235, 235), (0, 0, 0)
PANEL_PX, GAP_PX, LINE_PX, TITLE_PX = 640, 12, 22, 30
FONT, LETTERS = cv2.FONT_HERSHEY_SIMPLEX, 0.5
COLUMNS = 135
"""Letters that a line holds."""
DIM = 0.35
"""Of the picture behind the skin."""


def draw_sight(seen: Seen, findings: Sequence[Finding]) -> Canvas:
    """The picture (h, w, 3), BGR."""
    scale = PANEL_PX / seen.image.shape[1]
    size = PANEL_PX, round(seen.image.shape[0] * scale)
    lines = [(line, LEVELS[finding.level]) for finding in findings for line in _lines_of(finding)]
    canvas = np.full((TITLE_PX + size[1] + LINE_PX * (len(lines) + 1), 2 * PANEL_PX + 3 * GAP_PX, 3), GROUND, np.uint8)
    frame = np.asarray(cv2.resize(seen.image, size, interpolation=cv2.INTER_AREA), np.uint8)
    for left, panel, title in (
        (GAP_PX, _with_tracks(frame, seen.tracks, scale), "face and hands; left and right are the person's own"),
        (2 * GAP_PX + PANEL_PX, _with_skin(frame, seen.skin), "in colour: what passes for skin"),
    ):
        canvas[TITLE_PX : TITLE_PX + size[1], left : left + PANEL_PX] = panel
        _write(canvas, title, (left, 20), INK)
    for number, (line, colour) in enumerate(lines):
        _write(canvas, line, (GAP_PX, TITLE_PX + size[1] + LINE_PX * (number + 1)), colour)
    return canvas


def _with_tracks(frame: Canvas, tracks: Sequence[Track], scale: float) -> Canvas:
    drawn = frame.copy()
    for track in tracks:
        colour = COLOURS[track.kind]
        x, y, w, h = (round(value * scale) for value in track.bbox_px)
        outline = np.frombuffer(track.contour, "<i2").reshape(-1, 1, 2)
        if len(outline):
            cv2.polylines(drawn, [np.rint(outline * scale).astype(np.int32)], True, colour, 2, cv2.LINE_AA)
        cv2.rectangle(drawn, (x, y), (x + w, y + h), colour, 1)
        said = f"face {track.bbox_px[2]:.0f} px" if track.kind == "face" else NAMES[track.kind]
        _write(drawn, said, (max(2, x), y - 6 if y > LINE_PX else y + h + LINE_PX), colour)
    return drawn


def _with_skin(frame: Canvas, skin: Canvas) -> Canvas:
    """The frame where skin is likelier than not, and dim and grey elsewhere."""
    mask = cv2.resize(skin, (frame.shape[1], frame.shape[0]), interpolation=cv2.INTER_LINEAR) >= LIKELIER
    grey = cv2.cvtColor(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    return np.where(mask[..., None], frame, grey * DIM).astype(np.uint8)


def _lines_of(finding: Finding) -> list[str]:
    text = finding.what + (f" -> {finding.advice}" if finding.advice else "")
    return textwrap.wrap(text, COLUMNS, subsequent_indent="    ")


def _write(canvas: Canvas, text: str, at: tuple[int, int], colour: Colour) -> None:
    cv2.putText(canvas, text, at, FONT, LETTERS, BLACK, 3, cv2.LINE_AA)
    cv2.putText(canvas, text, at, FONT, LETTERS, colour, 1, cv2.LINE_AA)
