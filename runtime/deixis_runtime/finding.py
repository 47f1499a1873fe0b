"""One thing that `deixis doctor` finds. Distributions add what only they can examine: `LOCAL_CHECKS`, `CAMERA_LOOKS`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Level = Literal["ok", "note", "wrong"]

LOCAL_CHECKS = "deixis.checks"
"""Entry points of this group are functions `(source: str | None) -> Iterable[Finding]` about this machine."""
CAMERA_LOOKS = "deixis.camera_looks"
"""Entry points of this group are functions `(CameraLook) -> Iterable[Finding]` about what is seen through a camera."""


@dataclass(frozen=True)
class CameraLook:
    """Which camera to look through, and where to draw what is seen.

    source: a device, file or URL of this machine; none: the frames of `robot`, from the router at `connect`.
    """

    source: str | None
    robot: str | None
    connect: str
    picture: Path


@dataclass(frozen=True)
class Finding:
    """Whether it is wrong, what it is, and what to do."""

    level: Level
    what: str
    advice: str = ""
