"""Settings of the guest tracker. Lengths are in face widths (fw), times in seconds."""

from __future__ import annotations

from typing import Literal

from deixis_runtime.settings import StageConfig
from pydantic import Field


class TrackerConfig(StageConfig):
    """How sure MediaPipe has to be, and how many people are followed."""

    max_persons: int = Field(default=4, ge=1, le=16, description="Each takes a hand graph: 25 MB, and most of the time.")
    face_confidence: float = Field(default=0.5, ge=0.1, lt=1, description="Least score of a face.")
    palm_confidence: float = Field(default=0.5, ge=0.1, lt=1, description="Least score of a palm that is not followed yet.")
    hand_confidence: float = Field(
        default=0.2,
        ge=0.05,
        lt=1,
        description="Least score of a hand that is followed. At .5 pointing hands are lost as soon as their palm is hidden.",
    )
    hand_model: Literal["lite", "full"] = Field(
        default="lite",
        description="Which of the two models of the wheel reads hands. full takes twice the time.",
    )
    forget_face_s: float = Field(default=1.5, gt=0, le=10, description="A person whose face is unseen for longer is forgotten.")
    forget_hand_s: float = Field(default=0.15, gt=0, le=10, description="A hand unseen for longer is forgotten.")
