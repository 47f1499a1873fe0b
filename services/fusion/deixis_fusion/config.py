"""Settings of the fusion stage."""

from __future__ import annotations

from typing import Literal

from deixis_runtime.settings import StageConfig
from pydantic import Field, model_validator


class FusionConfig(StageConfig):
    """Settings; the defaults are what the labelled clips were scored with."""

    rules: Literal["paper", "deixis"] = Field(
        default="deixis",
        description="`paper`: eqs 16 and 18 to the letter; `deixis`: with likelihoods of bearing and head gain.",
    )
    registry: str | None = Field(
        default=None, max_length=4096, description="SQLite file of the POIs; a default place if empty."
    )

    # joining
    age_limit_s: float = Field(default=0.3, gt=0, le=10, description="A frame is answered without stages that take longer.")
    lockstep_age_limit_s: float = Field(
        default=5.0, gt=0, le=60, description="The same in lockstep, where a slow machine must not change the answers."
    )
    dead_after_s: float = Field(default=1.5, gt=0, le=60, description="A silent stage without liveliness is dead after this.")

    source_silent_s: float = Field(default=1.5, gt=0, le=60, description="Without frames for so long, open episodes are ended.")

    # localisation
    face_width_m: float = Field(default=0.182, gt=0.05, le=0.5, description="Width of a face, ear to ear, for its distance.")
    distance_sigma: float = Field(default=0.06, ge=0, le=1, description="Relative standard deviation of the distance.")
    distance_time_s: float = Field(default=0.7, ge=0, le=60, description="Time constant that smooths a person's distance.")
    frontal_yaw_deg: float = Field(default=35, gt=0, le=180, description="Heads turned further give a poor face width.")
    hold_position_s: float = Field(default=2.0, ge=0, le=60, description="How long a person's last position is used.")
    wall_clearance_m: float = Field(default=0.15, ge=0, le=10, description="A POI this far behind a wall's face hangs on it.")

    # hand, eq. 16 and table 1
    phi_h_min_deg: float = Field(default=40, ge=0, le=180, description="paper: least bearing at which a hand is recognised.")
    phi_h_max_deg: float = Field(default=140, ge=0, le=180, description="paper: largest bearing at which a hand is recognised.")
    hand_min_deg: float = Field(default=25, ge=0, le=180, description="deixis: least bearing at which a hand is recognised.")
    hand_max_deg: float = Field(default=150, ge=0, le=180, description="deixis: largest bearing at which a hand is recognised.")
    hand_soft_deg: float = Field(default=15, gt=0, le=90, description="deixis: width of the borders of that range.")
    hand_miss: float = Field(
        default=0.25, ge=0, le=1, description="deixis: probability that a finger within that range is missed."
    )
    hand_refinement: float = Field(default=0.9, ge=0, le=1, description="deixis: part of each region's mass given to its POIs.")
    hand_discount: float = Field(default=0.08, ge=0, le=1, description="deixis: mass kept on the whole frame.")
    hand_sigma_floor_deg: float = Field(default=6, ge=0, le=90, description="deixis: error of the hand's bearing at least.")
    hand_outlier: float = Field(
        default=0.15, gt=0, lt=1, description="deixis: probability that the hand's bearing is nonsense."
    )

    # head, eq. 18
    phi_f_max_deg: float = Field(default=120, gt=0, le=180, description="paper: largest yaw at which a head is recognised.")
    paper_head_sigma_deg: float = Field(default=10, gt=0, le=90, description="paper: stands for the confusions of fig. 6.")
    head_range_deg: float = Field(default=95, gt=0, le=180, description="deixis: yaw beyond which a head is out of range.")
    head_range_soft_deg: float = Field(default=10, gt=0, le=90, description="deixis: width of the border of that range.")
    head_sigma_deg: float = Field(default=4, gt=0, le=90, description="deixis: how exactly people turn the head.")
    head_gain_min: float = Field(default=0.65, gt=0, le=1.5, description="deixis: smallest part of the way that heads turn.")
    head_gain_max: float = Field(default=1.0, gt=0, le=1.5, description="deixis: largest part of the way that heads turn.")
    head_full_turn: float = Field(default=0.65, ge=0, le=1, description="deixis: probability that a head turns the whole way.")
    head_overshoot_deg: float = Field(default=2, ge=0, le=20, description="deixis: a whole turn goes this much too far.")
    head_at_robot: float = Field(default=0.15, ge=0, lt=1, description="deixis: probability of looking at the robot instead.")
    head_outlier: float = Field(default=0.05, gt=0, lt=1, description="deixis: probability that the yaw is nonsense.")
    head_discount: float = Field(default=0.05, ge=0, le=1, description="deixis: mass kept on the whole frame.")

    # episodes
    min_stroke_s: float = Field(default=0.25, ge=0, le=10, description="Strokes shorter than this are no pointing.")
    max_gap_s: float = Field(default=0.3, ge=0, le=10, description="A stroke that drops out for less goes on.")
    settle_s: float = Field(default=0.2, ge=0, le=10, description="At first the head may still turn: less weight.")
    max_unclear_s: float = Field(default=1.0, ge=0, le=10, description="A hand held on may be unclear for so long.")
    swing_s: float = Field(
        default=0.4, ge=0, le=10, description="A hand that points to the other side for so long starts anew."
    )
    update_every_s: float = Field(default=0.2, ge=0, le=10, description="Updates of a target are at least this far apart.")
    max_evidence_age_s: float = Field(
        default=0.5, gt=0, le=10, description="A late stage still counts in a stroke for so long."
    )
    max_evidence_s: float = Field(default=5, gt=0, le=600, description="Of a long stroke the last seconds count.")

    # answer
    tie_margin: float = Field(default=0.08, ge=0, le=1, description="deixis: pignistic differences below this are ties.")
    max_ties: int = Field(default=3, ge=1, le=64, description="deixis: with more POIs tied, abstain.")
    max_conflict: float = Field(default=0.97, gt=0, le=1, description="deixis: with more conflict, abstain.")
    max_unknown: float = Field(default=0.9, gt=0, le=1, description="deixis: with more mass on the whole frame, abstain.")

    @model_validator(mode="after")
    def _ranges_are_ranges(self) -> FusionConfig:
        if self.phi_h_min_deg >= self.phi_h_max_deg:
            raise ValueError("phi_h_max_deg: must be larger than phi_h_min_deg")
        if self.hand_min_deg >= self.hand_max_deg:
            raise ValueError("hand_max_deg: must be larger than hand_min_deg")
        if self.head_gain_min >= self.head_gain_max:
            raise ValueError("head_gain_max: must be larger than head_gain_min")
        return self
