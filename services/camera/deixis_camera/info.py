"""What the stage says of its camera: the content of CameraInfo, and when it changes."""

from __future__ import annotations

from deixis_schemas.messages import CameraInfo, CameraMount, CameraState, Producer

from .calibration import Intrinsics


class CameraStatus:
    """State of the camera, kept by the loop thread."""

    def __init__(self, source: str, mount: CameraMount, lockstep: bool) -> None:
        self._source = source
        self._mount = mount
        self._lockstep = lockstep
        self._size = (0, 0)
        self._rate_hz = 0.0
        self._intrinsics: Intrinsics | None = None
        self._run = 0
        self._last_seq = -1
        self._state: CameraState = "starting"
        self._reason = ""
        self.changed = True

    @property
    def state(self) -> CameraState:
        """Whether it delivers."""
        return self._state

    def become(self, state: CameraState, reason: str = "") -> bool:
        """Enter a state; whether that is news."""
        news = (state, reason) != (self._state, self._reason)
        self._state, self._reason = state, reason
        self.changed |= news
        return news

    def has_rate(self, rate_hz: float) -> None:
        """Frames per second that are published, by what the source says."""
        self.changed |= rate_hz != self._rate_hz
        self._rate_hz = rate_hz

    def projects(self, width: int, height: int, intrinsics: Intrinsics) -> bool:
        """Pictures of this size follow, with these intrinsics; whether that is news."""
        news = (width, height) != self._size or intrinsics != self._intrinsics
        self._size, self._intrinsics = (width, height), intrinsics
        self.changed |= news
        return news

    def published(self, run: int, seq: int) -> None:
        """The frame went out; not news by itself."""
        self._run, self._last_seq = run, seq

    def info(self, producer: Producer, stamp_ns: int) -> CameraInfo:
        """The message."""
        intrinsics = self._intrinsics
        return CameraInfo(
            stamp_ns=stamp_ns,
            stage=producer.stage,
            instance=producer.instance,
            state=self._state,
            reason=self._reason[:2000],
            source=self._source,
            width=self._size[0],
            height=self._size[1],
            rate_hz=self._rate_hz,
            camera_matrix=intrinsics.camera_matrix if intrinsics else None,
            distortion_model=intrinsics.distortion_model if intrinsics else "none",
            distortion=list(intrinsics.distortion) if intrinsics else [],
            intrinsics=intrinsics.source if intrinsics else "",
            mount=self._mount,
            lockstep=self._lockstep,
            run=self._run,
            last_seq=self._last_seq,
        )
