"""What the bridge's camera says of itself: the content of CameraInfo, and whether it is news. Pure."""

from __future__ import annotations

from deixis_schemas.messages import CameraInfo, CameraMount, CameraState, Producer

from .intrinsics import RosLens


class CameraStatus:
    """State of the camera. `changed`: there is news since it was last set to False."""

    def __init__(self, producer: Producer, source: str, mount: CameraMount) -> None:
        self._info = CameraInfo(
            stamp_ns=0,
            stage=producer.stage,
            instance=producer.instance,
            state="starting",
            source=source,
            mount=CameraMount(**mount.model_dump()),
        )
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

    def sees_through(self, lens: RosLens) -> bool:
        """Frames follow that are seen through this lens; whether that is news."""
        info, before = self._info, self._info.model_copy()
        info.width, info.height, info.camera_matrix = lens.width, lens.height, lens.camera_matrix
        info.distortion_model, info.distortion, info.intrinsics = lens.distortion_model, list(lens.distortion), lens.source
        self.changed |= info != before
        return info != before

    def published(self, run: int, seq: int) -> None:
        """The frame went out; not news by itself."""
        self._info.run, self._info.last_seq = run, seq

    def info(self, stamp_ns: int) -> CameraInfo:
        """The message, speaking of `stamp_ns`."""
        return self._info.model_copy(update={"stamp_ns": stamp_ns})
