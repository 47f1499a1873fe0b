"""Keyframes: views of one head at known poses, about every 14 degrees, that new frames are matched against.

Matching against keyframes, not the previous frame, keeps drift out: with the previous frame as template errors add up to
9-21 degrees everywhere (PERCEPTION.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from deixis_runtime.lens import Pinhole

from .head import Array, Pose, Surface, angle_between
from .lsm import Template, observe, template_of
from .patch import Level


@dataclass(frozen=True)
class Keyframe:
    """One view: the pose and a template per pyramid level."""

    pose: Pose
    seen: Array
    """Rotation (3, 3) of the pose relative to the line head -> camera."""
    templates: tuple[Template, ...]


def take_keyframe(levels: Sequence[Level], surface: Surface, pose: Pose, camera: Pinhole) -> Keyframe:
    """Read the head's texture from a picture at a known pose."""
    views = (observe(level, surface, pose, camera) for level in levels)
    return Keyframe(pose, pose.seen(), tuple(template_of(view, len(surface.points_m)) for view in views))


@dataclass
class Keyframes:
    """The views of one head; the first is the frontal one."""

    spacing_deg: float
    limit: int
    views: list[Keyframe] = field(default_factory=list)

    def nearest(self, pose: Pose, count: int) -> list[Keyframe]:
        """The `count` views seen from the directions closest to the pose, closest first."""
        seen = pose.seen()
        order = np.argsort([angle_between(view.seen, seen) for view in self.views], kind="stable")
        return [self.views[i] for i in order[:count]]

    def wants(self, pose: Pose) -> bool:
        """Whether no view is within the spacing of the pose."""
        seen = pose.seen()
        return len(self.views) < self.limit and all(angle_between(view.seen, seen) >= self.spacing_deg for view in self.views)

    def add(self, view: Keyframe) -> None:
        """Keep a view."""
        self.views.append(view)
