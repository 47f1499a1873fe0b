"""Settings of the guest head pose stage."""

from __future__ import annotations

from deixis_runtime.settings import StageConfig
from pydantic import Field


class HeadposeConfig(StageConfig):
    """How many heads are read, and how far."""

    max_persons: int = Field(default=4, ge=1, le=16, description="Each takes a mesh graph: 15 MB, and 8 ms a frame.")
    mesh_confidence: float = Field(default=0.5, ge=0.1, lt=1, description="Least score of a face, found or followed.")
    reach_deg: float = Field(
        default=63.0, gt=20, le=90, description="Yaw to either side up to which angles are told; beyond it the side alone."
    )
    jump_deg: float = Field(default=25.0, gt=0, le=180, description="No head turns by more within one frame.")
    looks_to_start: int = Field(default=2, ge=1, le=30, description="Looks that have to agree before a yaw is told.")
    frames_kept: int = Field(default=8, ge=2, le=64, description="Frames that wait for their tracks.")
    horizontal_fov_deg: float = Field(
        default=60.0, gt=5, lt=170, description="Width of view assumed until camera/info tells the lens, degrees."
    )
