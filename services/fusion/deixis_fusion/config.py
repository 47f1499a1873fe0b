"""Settings of the fusion stage, in groups by what they are about: `--set fusion.hand.sigma_floor_deg=8`."""

from __future__ import annotations

from typing import Literal

from deixis_runtime.settings import StageConfig
from pydantic import Field, model_validator

from .confusion import ConfusionConfig


class JoiningConfig(StageConfig):
    """When a frame is answered, and who is not waited for."""

    age_limit_s: float = Field(default=0.3, gt=0, le=10, description="A frame is answered without stages that take longer.")
    lockstep_age_limit_s: float = Field(
        default=5.0, gt=0, le=60, description="The same in lockstep, where a slow machine must not change the answers."
    )
    dead_after_s: float = Field(default=1.5, gt=0, le=60, description="A silent stage without liveliness is dead after this.")
    source_silent_s: float = Field(default=1.5, gt=0, le=60, description="Without frames for so long, open episodes are ended.")


class PlaceConfig(StageConfig):
    """Where persons and the robot are."""

    # The root mean square of the clips' distance_error_percent on choosing seeds is 9 % over 12 clips, with adults and children
    # (`deixis eval --seeds 1000:1012 --lockstep --json FILE`); a little more for faces of another width than those.
    distance_sigma: float = Field(default=0.1, ge=0, le=1, description="Relative standard deviation of the distance.")
    distance_time_s: float = Field(default=0.7, ge=0, le=60, description="Time constant that smooths a person's distance.")
    frontal_yaw_deg: float = Field(default=35, gt=0, le=180, description="Heads turned further give a poor face width.")
    hold_s: float = Field(default=2.0, ge=0, le=60, description="How long a person's last position is used.")
    wall_clearance_m: float = Field(default=0.15, ge=0, le=10, description="A POI this far behind a wall's face hangs on it.")
    robot_pose_max_age_s: float = Field(
        default=1.0, gt=0, le=3600, description="A robot's pose older than the frame by more is still used, and said to be old."
    )


class HandConfig(StageConfig):
    """The `deixis` rules for the hand."""

    min_deg: float = Field(default=25, ge=0, le=180, description="Least bearing at which a hand is recognised.")
    max_deg: float = Field(default=150, ge=0, le=180, description="Largest bearing at which a hand is recognised.")
    soft_deg: float = Field(default=15, gt=0, le=90, description="Width of the borders of that range.")
    miss: float = Field(default=0.25, ge=0, le=1, description="Probability that a finger within that range is missed.")
    refinement: float = Field(default=0.9, ge=0, le=1, description="Part of each region's mass given to its POIs.")
    discount: float = Field(default=0.08, ge=0, le=1, description="Mass kept on the whole frame.")
    # These two by `deixis eval --stage fusion --seeds 0:20 --kinds point --set fusion.hand.NAME=VALUE`: calibration error .099,
    # with 6 and .15 (as they were before the stage's likelihood itself counted fingers lost) .130; by luck alone it is .13.
    sigma_floor_deg: float = Field(default=4, ge=0, le=90, description="Error of the hand's bearing and elevation at least.")
    outlier: float = Field(default=0.05, gt=0, lt=1, description="Probability that the hand's bearing is nonsense.")
    # Assumed, not fitted: no clip shows who means which of two shelves. The stage's own sigma holds what it says on clips that
    # it was not made on (`deixis eval --stage gesture`); the tail is for POIs whose height somebody guessed.
    elevation_outlier: float = Field(
        default=0.2, gt=0, le=1, description="Probability that the hand's elevation is nonsense; at 1 it does not count."
    )

    @model_validator(mode="after")
    def _range_is_a_range(self) -> HandConfig:
        if self.min_deg >= self.max_deg:
            raise ValueError("max_deg: must be larger than min_deg")
        return self


class HeadConfig(StageConfig):
    """The `deixis` rules for the head."""

    range_deg: float = Field(
        default=130, gt=0, le=180, description="Yaw beyond which a head is out of range, where the stage does not tell."
    )
    range_soft_deg: float = Field(default=10, gt=0, le=90, description="Width of the border of that range.")
    sigma_deg: float = Field(default=4, gt=0, le=90, description="How exactly people turn the head.")
    gain_min: float = Field(default=0.65, gt=0, le=1.5, description="Smallest part of the way that heads turn.")
    gain_max: float = Field(default=1.0, gt=0, le=1.5, description="Largest part of the way that heads turn.")
    full_turn: float = Field(default=0.65, ge=0, le=1, description="Probability that a head turns the whole way.")
    overshoot_deg: float = Field(default=2, ge=0, le=20, description="A whole turn goes this much too far.")
    at_robot: float = Field(default=0.15, ge=0, lt=1, description="Probability of looking at the robot instead.")
    outlier: float = Field(default=0.05, gt=0, lt=1, description="Probability that the yaw is nonsense.")
    discount: float = Field(default=0.05, ge=0, le=1, description="Mass kept on the whole frame.")
    # Assumed, not fitted: no clip shows who means which of two shelves. Wide, so that a wrong guess costs little.
    pitch_sigma_deg: float = Field(default=10, gt=0, le=90, description="How differently people hold the head, up and down.")
    pitch_gain_min: float = Field(default=0.3, ge=0, le=1.5, description="Smallest part of the way up or down that heads turn.")
    pitch_gain_max: float = Field(default=1.0, gt=0, le=1.5, description="Largest part of the way up or down that heads turn.")
    pitch_outlier: float = Field(
        default=0.5, gt=0, le=1, description="Probability that the pitch is nonsense; at 1 height does not count."
    )

    @model_validator(mode="after")
    def _gains_are_a_range(self) -> HeadConfig:
        if self.gain_min >= self.gain_max:
            raise ValueError("gain_max: must be larger than gain_min")
        if self.pitch_gain_min >= self.pitch_gain_max:
            raise ValueError("pitch_gain_max: must be larger than pitch_gain_min")
        return self


class PaperConfig(StageConfig):
    """The `paper` rules, in the paper's symbols."""

    phi_h_min_deg: float = Field(default=40, ge=0, le=180, description="Least bearing at which a hand is recognised.")
    phi_h_max_deg: float = Field(default=140, ge=0, le=180, description="Largest bearing at which a hand is recognised.")
    phi_f_max_deg: float = Field(
        default=120, gt=0, le=180, description="Largest yaw at which a head is recognised; less where the stage tells less."
    )

    @model_validator(mode="after")
    def _range_is_a_range(self) -> PaperConfig:
        if self.phi_h_min_deg >= self.phi_h_max_deg:
            raise ValueError("phi_h_max_deg: must be larger than phi_h_min_deg")
        return self


class EpisodesConfig(StageConfig):
    """What makes a pointing episode, and which of its frames count."""

    min_stroke_s: float = Field(default=0.25, ge=0, le=10, description="Strokes shorter than this are no pointing.")
    max_gap_s: float = Field(default=0.3, ge=0, le=10, description="A stroke that drops out for less goes on.")
    settle_s: float = Field(default=0.2, ge=0, le=10, description="At first the head may still turn: less weight.")
    max_unclear_s: float = Field(default=1.0, ge=0, le=10, description="A hand held on may be unclear for so long.")
    swing_s: float = Field(
        default=0.4, ge=0, le=10, description="A hand that points to the other side for so long starts anew."
    )
    max_evidence_age_s: float = Field(
        default=0.5, gt=0, le=10, description="A late stage still counts in a stroke for so long."
    )
    max_evidence_s: float = Field(default=5, gt=0, le=600, description="Of a long stroke the last seconds count.")


class AnswerConfig(StageConfig):
    """When an answer is given, and how much of it is published.

    `tempering`, `tie_ratio` and the limits are chosen by `python fitting/choose_decision.py`, on made-up strokes: see there.
    """

    # On made-up strokes least log loss lies at 0.8 to 0.9. Calibration error (ECE) at 0.85: .036 by our own model, .032 by a
    # worse one; of pignistic probabilities .063 and .019.
    tempering: float = Field(
        default=0.85, gt=0, le=1, description="deixis: chances go with the likelihood to this power: 1 believes every model."
    )
    # Of the POIs that are named alone, 8 % are wrong by our own model, 19 % by a worse one; without ties, at 0.8, 19 and 29 %.
    tie_ratio: float = Field(
        default=0.5, gt=0, le=1, description="deixis: POIs at least this likely, beside the likeliest, are tied with it."
    )
    max_ties: int = Field(default=3, ge=1, le=64, description="deixis: with more POIs tied, abstain.")
    max_conflict: float = Field(default=0.98, gt=0, le=1, description="deixis: with more contour conflict, abstain.")
    # These two let go of 3 to 5 % of strokes by our own model, and of 65 to 7 % of those that mean none of 2 to 30 POIs.
    least_fit: float = Field(
        default=0.01,
        ge=0,
        le=1,
        description="deixis: no POI is named that explains less of what was seen, beside one that hung where it pointed.",
    )
    credible: float = Field(default=0.9, gt=0, le=1, description="Probability that the POI meant is in the credible set.")
    update_every_s: float = Field(default=0.2, ge=0, le=10, description="Updates of a target are at least this far apart.")
    rows: int = Field(default=16, ge=1, le=64, description="How many POIs are told of in a message, the likeliest first.")


class FusionConfig(StageConfig):
    """Settings; the defaults are what the labelled clips were scored with."""

    rules: Literal["paper", "deixis"] = Field(
        default="deixis",
        description="`paper`: section 6 to the letter; `deixis`: with likelihoods of bearing and head gain.",
    )
    registry: str | None = Field(
        default=None, max_length=4096, description="SQLite file of the POIs; a default place if empty."
    )
    joining: JoiningConfig = Field(default_factory=JoiningConfig, description="Joining of what the stages say of a frame.")
    place: PlaceConfig = Field(default_factory=PlaceConfig, description="Places of persons and of the robot.")
    confusion: ConfusionConfig = Field(default_factory=ConfusionConfig, description="Table 1 and figure 6.")
    hand: HandConfig = Field(default_factory=HandConfig, description="deixis: the hand, beyond eq. 16.")
    head: HeadConfig = Field(default_factory=HeadConfig, description="deixis: the head, beyond eq. 18.")
    paper: PaperConfig = Field(default_factory=PaperConfig, description="paper: eqs 16 and 18.")
    episodes: EpisodesConfig = Field(default_factory=EpisodesConfig, description="Pointing episodes.")
    answer: AnswerConfig = Field(default_factory=AnswerConfig, description="The answer.")
