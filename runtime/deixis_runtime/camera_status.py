"""What a camera stage says of its camera: the content of CameraInfo, and whether it is news."""

from __future__ import annotations

from typing import Protocol

from deixis_schemas.messages import CameraInfo, CameraMount, CameraState, Producer

from .lens import DistortionModel, Matrix


class Projection(Protocol):
    """How pictures of one size project. `source`: where that is known from, one sentence."""

    @property
    def camera_matrix(self) -> Matrix:
        """K, row-major, pixels with the origin at the centre of the top left one."""

    @property
    def distortion_model(self) -> DistortionModel:
        """Which one the coefficients are of."""

    @property
    def distortion(self) -> tuple[float, ...]:
        """The coefficients."""

    @property
    def source(self) -> str:
        """Where it comes from."""


class CameraStatus:
    """State of the camera, kept by the loop thread. `changed`: there is news since it was last set to False."""

    def __init__(self, producer: Producer, source: str, mount: CameraMount, *, lockstep: bool = False) -> None:
        self._info = CameraInfo(
            stamp_ns=0,
            stage=producer.stage,
            instance=producer.instance,
            state="starting",
            source=source,
            mount=CameraMount(**mount.model_dump()),
            lockstep=lockstep,
        )
        self._projection: Projection | None = None
        self.changed = True

    @property
    def state(self) -> CameraState:
        """Whether it delivers."""
        return self._info.state

    def become(self, state: CameraState, reason: str = "") -> bool:
        """Enter a state; whether that is news."""
        info, reason = self._info, reason[:2000]
        news = (state, reason) != (info.state, info.reason)
        info.state, info.reason = state, reason
        self.changed |= news
        return news

    def has_rate(self, rate_hz: float) -> None:
        """Frames per second that are published, by what the source says."""
        self.changed |= rate_hz != self._info.rate_hz
        self._info.rate_hz = rate_hz

    def projects(self, width: int, height: int, projection: Projection) -> bool:
        """Pictures of this size follow, which project so; whether that is news."""
        info = self._info
        news = (width, height) != (info.width, info.height) or projection != self._projection
        if news:
            self._projection = projection
            info.width, info.height, info.camera_matrix = width, height, projection.camera_matrix
            info.distortion_model, info.distortion = projection.distortion_model, list(projection.distortion)
            info.intrinsics = projection.source
        self.changed |= news
        return news

    def published(self, run: int, seq: int) -> None:
        """The frame went out; not news by itself."""
        self._info.run, self._info.last_seq = run, seq

    def info(self, stamp_ns: int) -> CameraInfo:
        """The message, speaking of `stamp_ns`."""
        return self._info.model_copy(update={"stamp_ns": stamp_ns})
