"""Least-squares matching (eqs 1-4 of Pateraki et al. 2011) with the pose of an ellipsoid in place of six affine parameters.

Eq. 1, `f - e = g`: the template's grey value at a point of the head equals, up to gain and offset, the picture's where the
point projects. Linearised by the pose, gain and offset: `A x = l`, solved as `x = (A'PA)^-1 A'Pl` (eq. 4), repeated. Several
templates may be matched at once; they share the pose, each has its own gain and offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from deixis_runtime.lens import Pinhole

from .head import Array, Pose, Projection, Surface, project
from .patch import Level

HUBER = 1.345
LEAST_FACING = 0.26
"""Cosine of obliqueness at which points begin to count."""
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
    """The picture as seen through a pose, at the M points of the projection."""

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


def observe(level: Level, surface: Surface, pose: Pose, camera: Pinhole) -> Observation:
    """Sample the picture at all surface points; weights fall off toward the outline (the paper: toward the patch border)."""
    projection = project(surface, pose, camera, LEAST_FACING)
    values, gradients, inside = level.sample(projection.pixels)
    return Observation(projection, values, gradients, facing_weights(projection.facing) * inside)


def template_of(observation: Observation, surface_points: int) -> Template:
    """Keep what is seen as a template for a surface of so many points."""
    values, weights = np.zeros(surface_points), np.zeros(surface_points)
    values[observation.projection.points] = observation.values
    weights[observation.projection.points] = observation.weights
    return Template(values, weights)


def facing_weights(facing: Array) -> Array:
    """0 at 75 degrees obliqueness and beyond, 1 up to 55: near the outline background and model error take over."""
    return np.minimum((facing - LEAST_FACING) / 0.31, 1.0).clip(0.0)


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
    camera: Pinhole,
    prior: Prior,
    iterations: int,
) -> Match:
    """Find the pose at which the templates fit the picture, from `start`.

    prior: where the pose is expected, as a step from `start`; it keeps badly seen parameters calm.
    """
    pose, travelled = start, np.zeros(6)
    observation = observe(level, surface, pose, camera)
    for _ in range(iterations):
        step = _solve(observation, templates, prior, travelled)
        if step is None:
            break
        step = _bounded(step)
        pose, travelled = pose.moved(step), travelled + step
        observation = observe(level, surface, pose, camera)
        if _is_small(step, pose, camera, level):
            break
    return Match(pose, correlation(observation, templates))


def _solve(observation: Observation, templates: Sequence[Template], prior: Prior, travelled: Array) -> Array | None:
    """One linearised solution: the pose step (6,); none where too few points are seen."""
    by_pose = observation.projection.by_pose(observation.gradients)
    normal, right = np.zeros((6, 6)), np.zeros(6)
    for template in templates:
        weights = observation.weights * template.weights[observation.projection.points]
        seen = np.flatnonzero(weights)
        if len(seen) >= MIN_POINTS:
            f, g = template.values[observation.projection.points[seen]], observation.values[seen]
            part_normal, part_right = _pose_equations(by_pose[seen], f, g, weights[seen])
            normal += part_normal
            right += part_right
    if not np.any(normal):
        return None
    normal = INDEPENDENT * normal + prior.information
    right = INDEPENDENT * right + prior.right - prior.information @ travelled
    return np.asarray(np.linalg.solve(normal, right), np.float64)


def _pose_equations(by_pose: Array, f: Array, g: Array, weights: Array) -> tuple[Array, Array]:
    """Normal equations (6, 6) and right side (6,) of the pose by one template, its gain and offset eliminated."""
    gain, offset = radiometric_correction(f, g, weights)
    residual = gain * f + offset - g
    size = np.abs(residual)
    noise = max(1.4826 * float(np.partition(size, len(size) // 2)[len(size) // 2]), MIN_NOISE)
    p = weights * np.minimum(1.0, HUBER * noise / np.maximum(size, 1e-9)) / noise**2
    design = np.column_stack([by_pose, -f, -np.ones(len(f)), residual])
    joint = (design * p[:, None]).T @ design
    light = joint[6:8, 6:8] + 1e-6 * np.eye(2)
    eliminated = joint[:6, 6:8] @ np.linalg.inv(light)
    normal = joint[:6, :6] - eliminated @ joint[6:8, :6]
    right = joint[:6, 8] - eliminated @ joint[6:8, 8]
    return normal, right


def radiometric_correction(f: Array, g: Array, weights: Array) -> tuple[float, float]:
    """Gain and offset that bring template f to picture g (the paper: radiometric correction first); all (N,)."""
    total = weights.sum()
    mean_f, mean_g = weights @ f / total, weights @ g / total
    spread = weights @ (f - mean_f) ** 2
    gain = float(np.clip((weights @ ((f - mean_f) * (g - mean_g))) / max(spread, 1e-9), 0.3, 3.0))
    return gain, float(mean_g - gain * mean_f)


def _correlation(observation: Observation, template: Template) -> tuple[float, float]:
    points = observation.projection.points
    weights, values = observation.weights * template.weights[points], template.values[points]
    total = float(weights.sum())
    if np.count_nonzero(weights) < MIN_POINTS:
        return 0.0, total
    return pearson(values, observation.values, weights), total


def pearson(f: Array, g: Array, weights: Array) -> float:
    """Pearson's correlation of grey values f and g (N,), weighted (N,); 0 where one of them does not vary or nothing counts."""
    total = float(weights.sum())
    if total <= 0:
        return 0.0
    f, g = f - weights @ f / total, g - weights @ g / total
    spread = float((weights @ f**2) * (weights @ g**2))
    return float(weights @ (f * g)) / spread**0.5 if spread > 1e-9 else 0.0


def _bounded(step: Array) -> Array:
    """Limit a step to 20 degrees and 4 cm: a linearisation says nothing beyond."""
    turn, shift = float(np.linalg.norm(step[:3])), float(np.linalg.norm(step[3:5]))
    return np.asarray(step / max(1.0, turn / np.radians(20), shift / 0.04))


def _is_small(step: Array, pose: Pose, camera: Pinhole, level: Level) -> bool:
    pixels = float(np.linalg.norm(step[3:5])) * camera.focal_px / pose.position_m[2] * level.scale
    return pixels < 0.03 and bool(np.linalg.norm(step[:3]) < np.radians(0.15))
