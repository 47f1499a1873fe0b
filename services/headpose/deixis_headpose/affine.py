"""Least-squares matching of a face patch between two frames by an affine transformation (eqs 1-4 of Pateraki et al. 2011).

A patch is six parameters `(a0, a1, a2, b0, b1, b2)` that place the template's square, x0 and y0 from -1 to 1, in a picture
(eq. 2). Its grey values in frame n are the template f; the matching finds the parameters at which frame n + 1 shows the same.
All pixels are those of the picture, whatever pyramid level is looked at. `affine_head.py` makes angles of the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from .head import Array
from .lsm import pearson, radiometric_correction
from .patch import Level

FINEST_SIDE = 32
"""Template points along each side on the finest level; half as many on each coarser one, as there are half the pixels."""
CONVERGED_PX = 0.05
"""A step that moves no corner of the patch by more, in pixels of the level, is the last one."""
MOST_ITERATIONS = 12
"""Fast convergence is expected (section 5.2): a finest level that needs more is not believed."""
MOST_REVERSALS = 3
"""So many times may a parameter's correction turn round while it is still worth a tenth of the largest one."""
LARGEST_SHIFT, LARGEST_STRETCH = 0.7, 0.35
"""How far from where it is expected a patch may be, and how much more it may stretch or shear, shares of its half width."""

Refusal = Literal["iterations", "steps grow", "steps alternate", "size", "correlation"]
"""The criterion of section 5.2 that a match fails; the last is ours."""


class PatchMatch(NamedTuple):
    """Where a template was found in a picture."""

    parameters: Array
    """(6,) of eq. 2, picture pixels."""
    steps_px: Array
    """(k, 6) corrections of the k iterations on the finest level, pixels of that level."""
    correlation: float
    """Pearson's, of the grey values of template and patch, weighted as the matching is."""


def template_points(side: int) -> Array:
    """Positions (side * side, 2) of the template's points: x0, y0 from -1 to 1, evenly spread."""
    along = (np.arange(side) + 0.5) / side * 2 - 1
    return np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)


def border_weights(points: Array) -> Array:
    """Diagonal (N,) of the weight matrix P: 1 at the patch's centre, toward 0 at its border (section 5.1)."""
    return np.asarray(np.prod(1 - points**2, axis=1), np.float64)


def transform(parameters: Array, points: Array) -> Array:
    """Eq. 2: where the template's points (N, 2) lie in the picture (N, 2), pixels; parameters: (6,)."""
    a0, a1, a2, b0, b1, b2 = parameters
    x0, y0 = points.T
    return np.stack([a0 + a1 * x0 + a2 * y0, b0 + b1 * x0 + b2 * y0], axis=1)


def take_template(levels: Sequence[Level], parameters: Array) -> list[Array]:
    """Grey values f of the patch in a frame, one array (side * side,) per pyramid level, finest first."""
    return [level.sample(transform(parameters, template_points(_side(k))))[0] for k, level in enumerate(levels)]


def design_matrix(gradients: Array, points: Array) -> Array:
    """A (N, 6): derivative of g by the parameters, in the order of eq. 3. gradients (N, 2) of g by the pixel, points (N, 2)."""
    by_position = np.column_stack([np.ones(len(points)), points])
    return np.hstack([gradients[:, :1] * by_position, gradients[:, 1:] * by_position])


def least_squares(design: Array, weights: Array, discrepancy: Array) -> Array | None:
    """Eq. 4: x = (A'PA)^-1 A'Pl (6,); none where the patch's texture does not determine it. weights: diagonal of P (N,)."""
    weighted = design * weights[:, None]
    normal = weighted.T @ design
    # A direction without texture leaves the normal matrix singular; by how much does not depend on the contrast.
    if np.linalg.cond(normal) > 1e6:
        return None
    return np.asarray(np.linalg.solve(normal, weighted.T @ discrepancy), np.float64)


def match_patch(levels: Sequence[Level], template: Sequence[Array], start: Array, most: int = MOST_ITERATIONS) -> PatchMatch:
    """Find the template in a frame, from the parameters `start` (6,), by the coarsest level first: it bears fast motion.

    levels: of the frame, finest first. template: of `take_template`, as many levels. most: iterations on each level.
    """
    found = PatchMatch(start, np.zeros((0, 6)), 0.0)
    for k in reversed(range(len(levels))):
        found = match_level(levels[k], template[k], found.parameters, most)
    return found


def match_level(level: Level, template: Array, start: Array, most: int) -> PatchMatch:
    """Repeat the linearised solution of eq. 1, f - e = g, on one level. template: (side * side,) grey values f."""
    points = template_points(round(len(template) ** 0.5))
    parameters: Array = start
    steps: list[Array] = []
    for _ in range(most):
        step = _correction(level, template, points, parameters)
        if step is None:
            return PatchMatch(parameters, np.array(steps).reshape(-1, 6), 0.0)
        parameters = parameters + step
        steps.append(step * level.scale)
        if corner_shift(steps[-1]) < CONVERGED_PX:
            break
    values, _, inside = level.sample(transform(parameters, points))
    return PatchMatch(parameters, np.array(steps).reshape(-1, 6), pearson(template, values, border_weights(points) * inside))


def corner_shift(step: Array) -> float:
    """How far a change (6,) of the parameters moves that corner of the patch which it moves farthest, in its pixels."""
    return float(np.hypot(np.abs(step[:3]).sum(), np.abs(step[3:]).sum()))


def refusal(match: PatchMatch, start: Array, least_correlation: float) -> Refusal | None:
    """The first criterion that the match fails, or none: it is accepted.

    Section 5.2 watches the number of iterations, the size of the parameters' alteration and its magnitude and sign in every
    iteration, but tells no numbers: those above are a choice. The correlation is ours; without it a patch of something else
    on which the iterations happen to converge would pass. start: the parameters (6,) that were expected in this frame.
    """
    sizes = np.array([corner_shift(step) for step in match.steps_px])
    if not len(sizes) or sizes[-1] >= CONVERGED_PX:
        return "iterations"
    if sizes[-1] > sizes[0]:
        return "steps grow"
    if _reversals(match.steps_px) > MOST_REVERSALS:
        return "steps alternate"
    if not _size_is_possible(match.parameters - start, start):
        return "size"
    return "correlation" if match.correlation < least_correlation else None


def _side(level: int) -> int:
    return max(FINEST_SIDE >> level, 6)


def _correction(level: Level, template: Array, points: Array, parameters: Array) -> Array | None:
    """One solution of eqs 3 and 4: the correction (6,) of the parameters, picture pixels; none where there is none."""
    values, gradients, inside = level.sample(transform(parameters, points))
    weights = border_weights(points) * inside
    if np.count_nonzero(weights) < len(points) // 2:
        return None
    gain, offset = radiometric_correction(template, values, weights)
    return least_squares(design_matrix(gradients, points), weights, gain * template + offset - values)


def _reversals(steps: Array) -> int:
    """Most changes of sign of one parameter's corrections (k, 6), those aside that are small beside the first step."""
    matter = np.where(np.abs(steps) > 0.1 * np.abs(steps).max(), np.sign(steps), 0)
    return int(np.max(np.count_nonzero(matter[1:] * matter[:-1] < 0, axis=0), initial=0))


def _size_is_possible(change: Array, start: Array) -> bool:
    """Whether a patch that was expected at `start` (6,) can be off by so much (6,)."""
    half_width = float(np.hypot(start[1], start[4]))
    shift, stretch = np.hypot(change[0], change[3]), np.abs(change[[1, 2, 4, 5]]).max()
    return bool(shift < LARGEST_SHIFT * half_width and stretch < LARGEST_STRETCH * half_width)
