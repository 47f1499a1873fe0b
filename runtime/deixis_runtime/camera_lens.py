"""The lens that frames are seen through: the camera's, as last told in `camera/info`; until then an assumed one."""

from __future__ import annotations

from collections.abc import Iterable

from deixis_schemas.messages import CameraInfo, CameraMount

from .lens import Lens, LensError


class CameraLens:
    """Keeps the newest intrinsics of a camera; before there are any, a pinhole of `horizontal_fov_deg` stands in."""

    def __init__(self, horizontal_fov_deg: float) -> None:
        self._fov_deg = horizontal_fov_deg
        self._told: Lens | None = None
        self._refused = ""
        self._other_shape = ""
        self.mount = CameraMount()  # how the camera sits on its robot, as last told

    def hear(self, infos: Iterable[CameraInfo]) -> list[str]:
        """Take what the camera says of itself, oldest first. Returns why a lens was refused, for each that cannot be.

        A camera that has no intrinsics yet, as when it starts anew, takes back none: no frame of it is there to be misread.
        """
        refused = []
        for info in infos:
            if info.camera_matrix is None:
                continue
            try:
                self._told, self.mount, self._refused = Lens.of(info), info.mount, ""
            except LensError as error:
                self._refused = f"{info.stage}/{info.instance}: {error}"
                refused.append(self._refused)
        return refused

    def of_frame(self, width: int, height: int) -> Lens:
        """The lens to read pictures of that size with."""
        if self._told is None:
            return Lens.assumed(width, height, self._fov_deg)
        told = f"{self._told.width} x {self._told.height}"
        self._other_shape = "" if self._told.fits(width, height) else f"{told}, pictures have {width} x {height}"
        return self._told

    @property
    def note(self) -> str | None:
        """For the stage's health: why angles may be misread; none once the camera has told a lens that fits its pictures."""
        instead = "the one told before is used" if self._told else f"one {self._fov_deg:g} degrees wide is assumed"
        if self._refused:
            return f"camera/info: the lens of {self._refused}; {instead}"
        if self._told is None:
            return f"no intrinsics from camera/info yet: a lens {self._fov_deg:g} degrees wide is assumed"
        if self._other_shape:
            return f"camera/info: the lens is for {self._other_shape}: another aspect ratio, so angles are misread"
        return None
