"""Settings of the camera stage: the `camera:` section of a site file, `settings.camera` and `--set` share these names."""

from __future__ import annotations

from typing import Literal

from deixis_runtime.settings import StageConfig
from deixis_schemas.messages import CameraMount
from pydantic import ConfigDict, Field, field_validator


class Mount(CameraMount):
    """The mount as written by a person: a misspelt field is an error, not ignored as on the wire."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class CameraConfig(StageConfig):
    """What to read and how to publish it."""

    source: str = Field(
        default="0",
        min_length=1,
        max_length=2000,
        description="Device number or path, video or GIF file, picture, folder of pictures, or http(s):// or rtsp(s):// URL.",
    )
    encoding: Literal["auto", "bgr8", "jpeg"] = Field(
        default="auto",
        description="bgr8: raw bytes (grey pictures go as mono8); jpeg: smaller, for a network; auto: jpeg while a stage that "
        "reads frames is a client of another router than the camera's, as on another host, else raw.",
    )
    quality: int = Field(default=85, ge=1, le=100, description="JPEG quality; the best, where it adapts.")
    adapt: bool = Field(
        default=True,
        description="Send less while answers of stages on another host come late or not at all, and more again when they come "
        "in time: JPEG quality first, then rate. Never on one host, nor in lockstep.",
    )
    adapt_least_quality: int = Field(
        default=50, ge=1, le=100, description="Adapting: lowest JPEG quality. At 50 the shipped clips are answered as raw ones."
    )
    adapt_least_rate_hz: float = Field(default=5.0, ge=0.2, le=60, description="Adapting: fewest frames per second.")
    adapt_slack_ms: float = Field(
        default=150.0,
        ge=10,
        le=1000,
        description="Adapting: how much longer than the quickest answer of late a frame may be without one, before the next is "
        "held back. A frame waits on the way about so long at most, in milliseconds.",
    )
    rate_hz: float | None = Field(
        default=None,
        gt=0,
        le=240,
        description="Most frames per second; for a folder the rate it plays at. None: the source's own, 5 for a folder.",
    )
    max_width: int = Field(
        default=1280, ge=64, le=8192, description="Pictures wider or higher than this many pixels are scaled down to it."
    )
    width: int | None = Field(default=None, ge=64, le=8192, description="Picture width to ask a device for; None: its own.")
    height: int | None = Field(default=None, ge=64, le=8192, description="Picture height to ask a device for; None: its own.")
    pixel_format: str | None = Field(
        default=None,
        pattern=r"^[A-Za-z0-9 ]{4}$",
        description="Four-character format to ask a device for, e.g. MJPG: many need it for more than 640 x 480 at 30 Hz.",
    )
    calibration: str | None = Field(
        default=None,
        min_length=1,
        description="ROS camera_info YAML, relative to the site file; None: assume horizontal_fov_deg.",
    )
    horizontal_fov_deg: float = Field(
        default=60.0, ge=10, le=170, description="Horizontal field of view to assume where there is no calibration, degrees."
    )
    mount: Mount = Field(default_factory=Mount, description="Pose of the optical centre in base_link.")
    loop: bool = Field(
        default=False, description="Play a file or folder again and again, in lockstep too at its own rate at most."
    )
    open_timeout_s: float = Field(default=5.0, ge=0.5, le=60, description="Longest wait for a file or stream to open.")
    read_timeout_s: float = Field(
        default=5.0, ge=0.5, le=60, description="Longest wait for the next picture of a stream before it counts as lost."
    )
    stalled_after_s: float = Field(
        default=3.0, ge=0.5, le=60, description="A live source without a new picture for this long is said to be stalled."
    )
    retry_first_s: float = Field(default=0.5, gt=0, le=60, description="Pause before the first retry; doubled after each.")
    retry_longest_s: float = Field(default=10.0, gt=0, le=600, description="Longest pause between two retries.")
    decoder_threads: int = Field(
        default=1, ge=1, le=16, description="Threads of the video decoder; more delay a live picture by as many frames."
    )
    subscriber_wait_s: float = Field(
        default=5.0, ge=0, le=60, description="Longest wait for a subscriber before a file starts to play (not in lockstep)."
    )
    lockstep_start_s: float = Field(
        default=20.0, ge=0, le=120, description="Lockstep: longest wait for the other stages before the first frame."
    )
    lockstep_timeout_s: float = Field(
        default=10.0, ge=0.1, le=60, description="Lockstep: longest wait for fusion's answer to a frame before the next is fed."
    )

    @field_validator("source", mode="before")
    @classmethod
    def _number_is_a_device(cls, source: object) -> object:
        return str(source) if isinstance(source, int) and not isinstance(source, bool) else source
