"""Settings of the bridge: how ROS is reached, and what of it is wanted. Which of the two programs has which, says its class."""

from __future__ import annotations

import os
from typing import Annotated, Any, Literal

from deixis_runtime.settings import StageConfig
from deixis_schemas.messages import CameraMount
from pydantic import AfterValidator, ConfigDict, Field, model_validator

from .names import NAMESPACE_PATTERN, is_topic
from .preparation import Wanted
from .ros_types import Distribution

DEVICE_ONLY = frozenset(
    {
        "adapt",
        "adapt_least_quality",
        "adapt_least_rate_hz",
        "adapt_slack_ms",
        "calibration",
        "decoder_threads",
        "height",
        "lockstep_start_s",
        "lockstep_timeout_s",
        "loop",
        "open_timeout_s",
        "pixel_format",
        "read_timeout_s",
        "retry_first_s",
        "retry_longest_s",
        "source",
        "subscriber_wait_s",
        "width",
    }
)
"""Settings that a site's `camera:` may hold for our own camera, and that mean nothing here: the pictures are ROS's."""


def _topic(name: str) -> str:
    if not is_topic(name):
        raise ValueError(f"'{name}' is no name of a ROS topic")
    return name


def _domain_of_environment() -> Any:
    return os.environ.get("ROS_DOMAIN_ID") or 0


TopicName = Annotated[str, AfterValidator(_topic)]


class RosConfig(StageConfig):
    """How ROS is reached."""

    router: str = Field(
        default="tcp/127.0.0.1:7447", min_length=1, max_length=500, description="Zenoh router of ROS (rmw_zenohd)."
    )
    domain: int = Field(
        default_factory=_domain_of_environment,
        ge=0,
        le=232,
        validate_default=True,
        description="ROS_DOMAIN_ID; by default that of the environment, else 0.",
    )
    distribution: Distribution = Field(
        default="jazzy", description="Of ROS, for type hashes and definitions; humble's rmw_zenoh has no hashes."
    )
    namespace: str = Field(default="/", pattern=NAMESPACE_PATTERN, max_length=200, description="Namespace of our node.")
    retry_s: float = Field(default=1.0, ge=0.1, le=60, description="Pause before the next try where ROS's router is not there.")


class Mount(CameraMount):
    """The mount as written by a person: a misspelt field is an error, not ignored as on the wire."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class RosCameraConfig(StageConfig):
    """Settings of `deixis-ros2-camera`: a site's `camera:`, less what only a device has."""

    ros: RosConfig = Field(default_factory=RosConfig, description="How ROS is reached.")
    image: TopicName = Field(default="/camera/image_raw", description="Topic of the pictures.")
    compressed: bool = Field(default=False, description="That topic carries CompressedImage (JPEG or PNG), not Image.")
    camera_info: TopicName | None = Field(
        default=None, description="Topic of the lens; by default `camera_info` beside the pictures' topic."
    )
    rectified: bool = Field(default=False, description="The pictures are rectified (image_rect): the lens is P, undistorted.")
    stamps: Literal["header", "arrival"] = Field(
        default="header", description="When a picture was captured: by its header, or when it came here (simulated time, bags)."
    )
    most_off_s: float = Field(
        default=5.0,
        ge=0.1,
        le=3600,
        description="A header's stamp further from this host's clock is not used, and that is said.",
    )
    encoding: Wanted = Field(
        default="auto",
        description="How frames are published: auto (JPEG as it comes, all else raw), raw, or as JPEG.",
    )
    quality: int = Field(default=85, ge=1, le=100, description="JPEG quality where we make the JPEG.")
    rate_hz: float | None = Field(default=None, gt=0, le=240, description="Most frames per second; None: as they come.")
    max_width: int = Field(
        default=1280, ge=64, le=8192, description="Pictures wider or higher than this are scaled down to it."
    )
    horizontal_fov_deg: float = Field(
        default=60.0, ge=10, le=170, description="Field of view to assume while ROS tells no lens."
    )
    mount: Mount = Field(default_factory=Mount, description="Pose of the optical centre in base_link.")
    stalled_after_s: float = Field(
        default=3.0, ge=0.5, le=60, description="Without a new picture for this long the camera is said to be stalled."
    )

    @model_validator(mode="before")
    @classmethod
    def _without_the_devices(cls, content: Any) -> Any:
        if not isinstance(content, dict):
            return content
        return {name: value for name, value in content.items() if name not in DEVICE_ONLY}


class RosAnswerConfig(StageConfig):
    """Settings of `deixis-ros2`: `settings.ros2` of a site."""

    ros: RosConfig = Field(default_factory=RosConfig, description="How ROS is reached.")
    target: TopicName = Field(default="/deixis/pointed_target", description="Topic of what persons point at.")
    people: bool = Field(
        default=True,
        description="Publish who is seen where (ROS4HRI). ROS has no access control: all who reach its router read it.",
    )
    people_rate_hz: float = Field(default=10.0, gt=0, le=60, description="Most updates of the people per second.")
    transforms: bool = Field(default=True, description="Publish face_ID and gaze_ID on /tf.")
    camera_frame: str = Field(
        default="camera_optical_frame",
        pattern=r"^[A-Za-z_][A-Za-z0-9_/]{0,100}$",
        description="ROS's name of the camera's optical frame (x right, y down, z forward), in which the people are.",
    )
    map_frame: str = Field(
        default="map", pattern=r"^[A-Za-z_][A-Za-z0-9_/]{0,100}$", description="ROS's name of the map that the points lie in."
    )
    most_off_s: float = Field(
        default=5.0, ge=0.1, le=3600, description="A pose's stamp further from this host's clock is not used; that is said."
    )
    pose: TopicName | None = Field(
        default=None,
        description="Topic of the robot's pose in the map, PoseWithCovarianceStamped, e.g. /amcl_pose; None: not from ROS.",
    )
