"""Settings of the guest gesture stage. Lengths are in face widths (fw, `anatomy.FACE_WIDTH_M`), times in seconds."""

from __future__ import annotations

from typing import Literal

from deixis_runtime.settings import StageConfig
from pydantic import Field


class GestureConfig(StageConfig):
    """When a hand gestures, and how its fingers are read."""

    max_hands: int = Field(
        default=4, ge=1, le=16, description="Raised hands whose fingers are read: 15 MB each, 12 ms a frame."
    )
    palm_confidence: float = Field(default=0.5, ge=0.1, lt=1, description="Least score of a palm that is not followed yet.")
    hand_confidence: float = Field(default=0.2, ge=0.05, lt=1, description="Least score of a hand that is followed.")
    hand_model: Literal["lite", "full"] = Field(default="lite", description="Which of the two models of the wheel reads hands.")
    raised_below_face: float = Field(
        default=2.3, ge=0, le=6, description="A hand higher than this below the face is raised, fw."
    )
    raised_beside_below_face: float = Field(default=3.2, ge=0, le=6, description="The same for a hand beside the body, fw.")
    beside_body: float = Field(default=2.2, ge=0, le=6, description="Sideways from the face, a hand is off the body, fw.")
    still_speed: float = Field(default=1.5, gt=0, le=20, description="A hand slower than this becomes still, fw/s.")
    moving_speed: float = Field(
        default=2.5, gt=0, le=40, description="A still hand that becomes faster than this leaves, fw/s."
    )
    speed_window_s: float = Field(default=0.15, gt=0, le=1, description="Time over which speed is measured.")
    settle_s: float = Field(default=0.25, ge=0, le=2, description="A hand is still for so long before it is in a stroke.")
    forget_s: float = Field(default=0.4, gt=0, le=5, description="A hand or a face unseen for longer is forgotten.")
    frame_wait_s: float = Field(default=0.05, ge=0, le=1, description="Tracks wait so long for the picture that they speak of.")
    horizontal_fov_deg: float = Field(
        default=60.0, gt=5, lt=170, description="Width of view assumed until camera/info tells the lens, degrees."
    )
