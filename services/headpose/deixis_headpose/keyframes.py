"""Keyframes: views of one head at known poses, about every 14 degrees, that new frames are matched against.

Matching against keyframes, not the previous frame, keeps drift out: with the previous frame as template errors add up to
9-21 degrees everywhere (PERCEPTION.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .head import Camera, Pose, Surface
from .lsm import Template, observe
from .patch import Level


@dataclass(frozen=True)
class Keyframe:
    """One view: the pose and a template per pyramid level."""

    pose: Pose
    templates: tuple[Template, ...]


def take_keyframe(levels: Sequence[Level], surface: Surface, pose: Pose, camera: Camera) -> Keyframe:
    """Read the head's texture from a picture at a known pose."""
    seen = [observe(level, surface, pose, camera) for level in levels]
    return Keyframe(pose, tuple(Template(o.values, o.weights) for o in seen))


@dataclass
class Keyframes:
    """The views of one head; the first is the frontal one."""

    spacing_deg: float
    limit: int
    views: list[Keyframe] = field(default_factory=list)

    def nearest(self, pose: Pose, count: int) -> list[Keyframe]:
        """The `count` views seen from the directions closest to the pose, closest first."""
        order = np.argsort([view.pose.angle_to(pose) for view in self.views], kind="stable")
        return [self.views[i] for i in order[:count]]

    def wants(self, pose: Pose) -> bool:
        """Whether no view is within the spacing of the pose."""
        return len(self.views) < self.limit and all(view.pose.angle_to(pose) >= self.spacing_deg for view in self.views)

    def add(self, view: Keyframe) -> None:
        """Keep a view."""
        self.views.append(view)
