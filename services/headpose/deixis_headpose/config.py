"""Settings of the headpose stage."""

from __future__ import annotations

from typing import Annotated, Literal

from deixis_runtime.settings import StageConfig
from pydantic import Field

SemiAxis = Annotated[float, Field(ge=0.04, le=0.15)]
"""Half of a head's width, height or depth, metres: those of an infant's to those of a head with much hair."""


class HeadposeConfig(StageConfig):
    """Settings of the headpose stage; defaults are for adults one to four metres from a VGA camera."""

    method: Literal["regression", "ellipsoid", "affine"] = Field(
        default="regression",
        description="How heads are read: each look by itself, absolute; by keyframes of a textured ellipsoid, from a frontal "
        "view on; or by the paper's chain of affine matches.",
    )
    max_persons: int = Field(default=3, ge=1, le=16, description="Heads matched per frame, largest first; bounds the work.")
    frames_kept: int = Field(default=6, ge=1, le=64, description="Last frames kept to be joined with their tracks.")
    horizontal_fov_deg: float = Field(
        default=60.0,
        gt=5,
        lt=170,
        description="Width of view assumed until camera/info tells the lens, degrees.",
    )

    # The surface that carries the texture, within the outlines of anatomy.py: with 0.160 m a little narrower than the face
    # with its ears (FACE_WIDTH_M) and than the head with its hair (HEAD_WIDTH_M), neither of which turns with the surface.
    head_semi_axes_m: tuple[SemiAxis, SemiAxis, SemiAxis] = Field(
        default=(0.080, 0.115, 0.085), description="Semi-axes of the textured ellipsoid: across, up, along, metres."
    )
    surface_points: int = Field(default=600, ge=200, le=10000, description="Points spread over the whole ellipsoid.")
    working_width_px: float = Field(default=64.0, ge=24, le=400, description="Heads wider than this are scaled down, pixels.")
    pyramid_levels: int = Field(default=3, ge=1, le=5, description="Resolution levels of the matching.")
    iterations: int = Field(default=5, ge=1, le=50, description="Iterations per level at most.")
    templates: int = Field(default=2, ge=1, le=8, description="Keyframes matched at once.")

    keyframe_spacing_deg: float = Field(default=14.0, gt=1, le=45, description="A new keyframe where none is this near.")
    keyframe_limit: int = Field(default=60, ge=1, le=500, description="Keyframes of one head at most.")
    gate: float = Field(default=0.75, gt=0, lt=1, description="Unweighted correlation below which a match is not believed.")
    still_gate: float = Field(
        default=0.96, gt=0, lt=1, description="Correlation above which a head that was still is not looked for elsewhere."
    )
    search_gate: float = Field(default=0.90, gt=0, lt=1, description="Correlation below which other starts are tried as well.")
    keyframe_gate: float = Field(default=0.82, gt=0, lt=1, description="Correlation needed to take a keyframe.")

    range_deg: float = Field(
        default=130.0,
        gt=30,
        le=180,
        description="Yaw beyond which the head is out of range, degrees; 100 at most but for `regression`.",
    )
    doubt_deg: float = Field(
        default=80.0, gt=20, le=120, description="Beyond this yaw, and where lost, a frontal face that is seen starts it anew."
    )
    hold_s: float = Field(default=0.25, ge=0, le=5, description="A pose below the gate is held this long, its sigma growing.")
    widest_sigma_deg: float = Field(
        default=25.0, gt=0, le=180, description="Of `regression`: a head whose yaw is less sure than this is lost, degrees."
    )
    forget_s: float = Field(default=2.0, gt=0, le=60, description="A person not in the tracks this long is forgotten.")

    initial_views: int = Field(
        default=3, ge=1, le=30, description="Sightings of the face from the front that must agree to start."
    )
