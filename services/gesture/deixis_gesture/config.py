"""Settings of the gesture stage. Lengths are in face widths (fw), times in seconds: free of scale and frame rate.

One face width is `anatomy.FACE_WIDTH_M`, the width of a face's box in the tracks.
"""

from __future__ import annotations

from typing import Literal

from deixis_runtime.settings import StageConfig
from pydantic import Field


class GestureConfig(StageConfig):
    """When a hand gestures, and when a gesture is a pointing."""

    rules: Literal["deixis", "paper"] = Field(
        default="deixis",
        description="What a stroke is: by the probability that it points, or by votes on its fingertips (paper, section 4).",
    )
    believed: float = Field(default=0.5, gt=0, lt=1, description="A stroke that points with this probability is a pointing.")
    doubted: float = Field(default=0.35, gt=0, lt=1, description="A pointing is none any more below this probability.")
    still_speed: float = Field(
        default=1.3, gt=0, le=20, description="A hand slower than this is still, fw/s (0.045 fw a frame at 30 frames/s)."
    )
    moving_speed: float = Field(
        default=1.7, gt=0, le=40, description="A still hand that becomes faster than this leaves, fw/s."
    )
    speed_window_s: float = Field(default=0.12, gt=0, le=1, description="Time over which speed is measured.")
    raised_below_face: float = Field(
        default=2.3, ge=0, le=6, description="A hand higher than this below the face is raised, fw."
    )
    raised_beside_below_face: float = Field(
        default=3.2, ge=0, le=6, description="The same for a hand held away from the body: a forearm's pointing is lower, fw."
    )
    raised_from_rest: float = Field(
        default=1.0, ge=0, le=6, description="A hand that came up so far from where it rested is raised, though lower, fw."
    )
    lowest_raised: float = Field(
        default=4.0, ge=0, le=6, description="But none that is lower than this below the face: there hands hang, fw."
    )
    beside_body: float = Field(
        default=2.3, ge=0, le=6, description="Sideways from the face's centre, a hand is off the body, fw."
    )
    hands_together: float = Field(
        default=2.0, ge=0, le=10, description="Two raised hands nearer to each other make a gesture together, no pointing, fw."
    )
    settle_s: float = Field(default=0.3, ge=0, le=2, description="A stroke lasts this long before its gesture is said.")
    forget_s: float = Field(default=0.4, gt=0, le=5, description="A hand or a face unseen for longer is forgotten.")
    walking_speed: float = Field(default=2.0, gt=0, le=40, description="A person whose face is faster than this walks, fw/s.")
    horizontal_fov_deg: float = Field(
        default=60.0,
        gt=5,
        lt=170,
        description="Width of view assumed until camera/info tells the lens, degrees.",
    )
