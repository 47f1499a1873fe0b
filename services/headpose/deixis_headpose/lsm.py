"""Least-squares matching (eqs 1-4 of Pateraki et al. 2011) with the pose of an ellipsoid in place of six affine parameters.

Eq. 1, `f - e = g`: the template's grey value at a point of the head equals, up to gain and offset, the picture's where the
point projects. Linearised by the pose, gain and offset: `A x = l`, solved as `x = (A'PA)^-1 A'Pl` (eq. 4), repeated. Several
templates may be matched at once; they share the pose, each has its own gain and offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .head import Array, Camera, Pose, Projection, Surface, project
from .patch import Level

HUBER = 1.345
MIN_POINTS = 40
INDEPENDENT = 0.0075
"""Share of the residuals that counts as independent: neighbouring ones are model error and move together."""
MIN_NOISE = 1.5
"""Grey levels: below it a residual is quantisation."""


class Template(NamedTuple):
    """What one keyframe says on one pyramid level."""

    values: Array
    """(N,) grey values at the surface points."""
    weights: Array
    """(N,) 0 where the keyframe did not see the point, toward 1 where it saw it squarely."""


class Observation(NamedTuple):
    """The picture as seen through a pose."""

    projection: Projection
    values: Array
    gradients: Array
    weights: Array


class Prior(NamedTuple):
    """What is expected of the pose before the picture is seen, as normal equations of the step from the start."""

    information: Array
    """(6, 6): rotation vector (rad), shift (m)."""
    right: Array
    """(6,): information times the expected step."""


class Match(NamedTuple):
    """Result of the matching."""

    pose: Pose
    correlation: float
    """Not robustly weighted: the weighted one always reads about 1 (PERCEPTION.md)."""
    covariance: Array
    """(6, 6) of the pose step, formal: residual variance by (A'PA)^-1."""


def observe(level: Level, surface: Surface, pose: Pose, camera: Camera) -> Observation:
    """Sample the picture at all surface points; weights fall off toward the outline (the paper: toward the patch border)."""
    projection = project(surface, pose, camera)
    values, gradients, inside = level.sample(projection.pixels)
    return Observation(projection, values, gradients, facing_weights(projection.facing) * inside)


def facing_weights(facing: Array) -> Array:
    """0 at 75 degrees obliqueness and beyond, 1 up to 55: near the outline background and model error take over."""
    return np.clip((facing - 0.26) / 0.31, 0.0, 1.0)


def correlation(observation: Observation, templates: Sequence[Template]) -> float:
    """Mean over the templates of Pearson's correlation of grey values over the points both see; 0 where too few."""
    shares = [_correlation(observation, template) for template in templates]
    points = np.array([share[1] for share in shares])
    return float(np.dot([share[0] for share in shares], points) / points.sum()) if points.sum() > 0 else 0.0


def match(
    level: Level,
    surface: Surface,
    templates: Sequence[Template],
    start: Pose,
    camera: Camera,
    prior: Prior,
    iterations: int,
) -> Match:
    """Find the pose at which the templates fit the picture, from `start`.

    prior: where the pose is expected, as a step from `start`; it keeps badly seen parameters calm.
    """
    pose, travelled = start, np.zeros(6)
    covariance = np.asarray(np.linalg.inv(prior.information), np.float64)
    observation = observe(level, surface, pose, camera)
    for _ in range(iterations):
        solved = _solve(observation, templates, prior, travelled)
        if solved is None:
            break
        step, covariance = solved
        step = _bounded(step)
        pose, travelled = pose.moved(step), travelled + step
        observation = observe(level, surface, pose, camera)
        if _is_small(step, pose, camera, level):
            break
    return Match(pose, correlation(observation, templates), covariance)


def _solve(
    observation: Observation, templates: Sequence[Template], prior: Prior, travelled: Array
) -> tuple[Array, Array] | None:
    """One linearised solution: pose step (6,) and its covariance (6, 6); none where too few points are seen."""
    by_pose = np.einsum("ni,nij->nj", observation.gradients, observation.projection.jacobian)
    count = 6 + 2 * len(templates)
    normal, right = np.zeros((count, count)), np.zeros(count)
    for k, template in enumerate(templates):
        seen = np.flatnonzero(observation.weights * template.weights)
        if len(seen) < MIN_POINTS:
            continue
        weights = observation.weights[seen] * template.weights[seen]
        f, g = template.values[seen], observation.values[seen]
        gain, offset = _radiometric(f, g, weights)
        residual = gain * f + offset - g
        noise = max(1.4826 * float(np.median(np.abs(residual))), MIN_NOISE)
        huber = np.minimum(1.0, HUBER * noise / np.maximum(np.abs(residual), 1e-9))
        p = weights * huber / noise**2
        design = np.column_stack([by_pose[seen], -f, -np.ones(len(seen))])
        weighted = design * p[:, None]
        rows = np.r_[0:6, 6 + 2 * k, 7 + 2 * k]
        normal[np.ix_(rows, rows)] += weighted.T @ design
        right[rows] += weighted.T @ residual
    if not np.any(normal[:6, :6]):
        return None
    normal, right = INDEPENDENT * normal, INDEPENDENT * right
    normal[:6, :6] += prior.information
    right[:6] += prior.right - prior.information @ travelled
    normal[range(6, count), range(6, count)] += 1e-6
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    return (inverse @ right)[:6], inverse[:6, :6]


def _radiometric(f: Array, g: Array, weights: Array) -> tuple[float, float]:
    """Gain and offset that bring template f to picture g (the paper: radiometric correction first)."""
    total = weights.sum()
    mean_f, mean_g = weights @ f / total, weights @ g / total
    spread = weights @ (f - mean_f) ** 2
    gain = float(np.clip((weights @ ((f - mean_f) * (g - mean_g))) / max(spread, 1e-9), 0.3, 3.0))
    return gain, float(mean_g - gain * mean_f)


def _correlation(observation: Observation, template: Template) -> tuple[float, float]:
    weights = observation.weights * template.weights
    total = float(weights.sum())
    if np.count_nonzero(weights) < MIN_POINTS:
        return 0.0, total
    f = template.values - weights @ template.values / total
    g = observation.values - weights @ observation.values / total
    spread = float((weights @ f**2) * (weights @ g**2))
    return float(weights @ (f * g)) / spread**0.5 if spread > 1e-9 else 0.0, total


def _bounded(step: Array) -> Array:
    """Limit a step to 20 degrees and 4 cm: a linearisation says nothing beyond."""
    turn, shift = float(np.linalg.norm(step[:3])), float(np.linalg.norm(step[3:5]))
    return np.asarray(step / max(1.0, turn / np.radians(20), shift / 0.04))


def _is_small(step: Array, pose: Pose, camera: Camera, level: Level) -> bool:
    pixels = float(np.linalg.norm(step[3:5])) * camera.focal_px / pose.position_m[2] * level.scale
    return pixels < 0.03 and bool(np.linalg.norm(step[:3]) < np.radians(0.15))
