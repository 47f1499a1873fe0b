"""Settings of the tracker stage: `settings.tracker` of a site file and `--set` share these names."""

from __future__ import annotations

from deixis_runtime.settings import StageConfig
from pydantic import Field


class TrackerConfig(StageConfig):
    """How frames become face and hand tracks. Lengths are in head widths (`persons.py`) unless the name says otherwise."""

    work_width_px: int = Field(
        default=640,
        ge=160,
        le=1920,
        description="Larger pictures are scaled down to this length of their longer side for tracking; pixels published are of "
        "the frame.",
    )
    max_persons: int = Field(default=4, ge=1, le=16, description="Most persons tracked at a time.")
    min_head_px: int = Field(default=8, ge=6, le=400, description="Narrowest head looked for, pixels of the working picture.")
    max_head_share: float = Field(
        default=0.9, gt=0.05, le=1, description="Widest head looked for, share of the picture's height."
    )
    confirm_odds: float = Field(
        default=1.8,
        gt=0,
        le=30,
        description="What looks, each worth 1 at most, add up to before a head is believed.",
    )
    hand_odds: float = Field(
        default=0.6,
        ge=-5,
        le=10,
        description="Log odds of the finder that speak neither for a hand nor against it. Chosen among 0.3, 0.6 and 1 by "
        "`deixis eval --stage tracker --seeds 1000:1012 --set tracker.hand_odds=...`",
    )
    lose_face_after_s: float = Field(default=2.5, gt=0, le=60, description="A head not seen as one for so long is dropped.")
    lose_hand_after_s: float = Field(default=0.5, gt=0, le=60, description="A hand not seen for so long is dropped.")
    prior_skin: float = Field(default=0.2, gt=0, lt=1, description="Share of skin expected among the pixels judged.")
    skin_high: int = Field(default=150, ge=1, le=255, description="A blob needs a pixel with this P(skin), of 255.")
    skin_low: int = Field(default=70, ge=1, le=255, description="A blob grows over pixels with this P(skin), of 255.")
    change_threshold: int = Field(
        default=20, ge=2, le=200, description="Difference from the background that counts as change, grey levels."
    )
    min_hand_area: float = Field(default=0.08, gt=0, le=5, description="Smallest hand, head widths squared.")
    hand_length: float = Field(
        default=1.0, gt=0.2, le=3, description="Length of a hand, by which it is cut from a bare forearm."
    )
    reach: float = Field(
        default=6.0,
        gt=1,
        le=20,
        description="Farthest a hand can be from its head: an arm is 4.5 long, and one stretched at the camera looks longer. "
        "Chosen among 5, 6 and 6.5 by `deixis eval --stage gesture --seeds 1000:1040 --set tracker.reach=...`",
    )
