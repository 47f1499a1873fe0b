"""What speaks against a measured lens, in sentences; the numbers come from the fit and from what its pictures cover."""

from __future__ import annotations

from collections.abc import Iterator

from .coverage import Coverage
from .lens_fit import LensFit

FEW_PICTURES, GOOD_PICTURES = 10, "15 to 40"
LEAST_TILT_DEG = 15.0
LARGE_ERROR_PX = 1.0
LEAST_SHARE = 0.5
UNSURE_FOCAL = 0.01
OFF_CENTRE = 0.15
UNEQUAL = 0.02


def advice(fit: LensFit, coverage: Coverage) -> list[str]:
    """Warnings, the weightiest first; empty where nothing speaks against the lens. `coverage` is of the pictures that count."""
    return [*_of_error(fit), *_of_pictures(fit, coverage), *_of_lens(fit, coverage)]


def tells_focal(fit: LensFit, coverage: Coverage) -> bool:
    """Whether boards were tilted enough for focal length and distance to be told apart. Where they were not, the fit's focal
    length may be many times off, and its deviation is as wrong as it is.
    """
    return told_tilt_deg(fit, coverage) >= LEAST_TILT_DEG


def told_tilt_deg(fit: LensFit, coverage: Coverage) -> float:
    """The largest angle between two boards: by the measured lens, which may be wrong, and by the assumed one, through which
    upright boards at the edge of a wide lens's picture look tilted, the smaller one.
    """
    return min(coverage.tilt_deg, fit.tilt_deg)


def _of_error(fit: LensFit) -> Iterator[str]:
    if fit.rms_px > LARGE_ERROR_PX:
        yield (
            f"the error is {fit.rms_px:.2f} px, more than {LARGE_ERROR_PX:g}: is the board flat, are columns, rows and pattern "
            "right, were pictures blurred?"
        )
    if fit.odd:
        names = ", ".join(picture.sighting.name for picture in fit.odd[:5]) + (" ..." if len(fit.odd) > 5 else "")
        yield f"{len(fit.odd)} pictures do not fit the others and were left out (blurred, or the board bent): {names}"


def _of_pictures(fit: LensFit, coverage: Coverage) -> Iterator[str]:
    count = len(fit.pictures)
    if count < FEW_PICTURES:
        yield f"{count} pictures are few: take {GOOD_PICTURES}"
    if not tells_focal(fit, coverage):
        tilt_deg = told_tilt_deg(fit, coverage)
        yield (
            f"the board was at nearly the same tilt in all pictures (at most {tilt_deg:.0f} degrees apart): focal "
            "length and distance cannot be told apart; lean its top away, then a side, by 30 degrees and more"
        )
    if coverage.share < LEAST_SHARE:
        yield (
            f"the board was seen in only {100 * coverage.share:.0f} % of the picture: bring it to all parts, or distortion "
            "is a guess there"
        )
    if coverage.unreached:
        yield f"no corner came near the picture's edge at the {', '.join(coverage.unreached)}: distortion is largest there"


def _of_lens(fit: LensFit, coverage: Coverage) -> Iterator[str]:
    if fit.focal_sigma is not None and tells_focal(fit, coverage) and fit.focal_sigma > UNSURE_FOCAL:
        yield f"the focal length is known to {100 * fit.focal_sigma:.1f} % only: more tilts, and more pictures"
    (fx, _, cx), (_, fy, cy), _ = fit.matrix.tolist()
    width, height = fit.size
    if max(abs(cx / width - 0.5), abs(cy / height - 0.5)) > OFF_CENTRE:
        yield f"the lens's axis is at ({cx:.0f}, {cy:.0f}), far from the picture's middle: a cut picture, or too few tilts"
    if abs(fx / fy - 1) > UNEQUAL:
        yield f"focal lengths across and down differ by {100 * abs(fx / fy - 1):.1f} %: a stretched picture, or a print that is"
