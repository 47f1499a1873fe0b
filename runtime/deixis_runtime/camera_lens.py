"""The lens that frames are seen through: the camera's, as last told in `camera/info`; until then an assumed one."""

from __future__ import annotations

from collections.abc import Iterable

from deixis_schemas.messages import CameraInfo, CameraMount

from .lens import Lens, LensError

ASPECT_TOLERANCE = 0.01
"""Pictures scaled to whole pixels differ by less from the camera's aspect ratio."""


class CameraLens:
    """Keeps the newest intrinsics of a camera; before there are any, a pinhole of `horizontal_fov_deg` stands in."""

    def __init__(self, horizontal_fov_deg: float) -> None:
        self._fov_deg = horizontal_fov_deg
        self._told: Lens | None = None
        self.mount = CameraMount()  # how the camera sits on its robot, as last told

    def hear(self, infos: Iterable[CameraInfo]) -> None:
        """Take what the camera says of itself, oldest first.

        A camera that has no intrinsics yet, as when it starts anew, takes back none: no frame of it is there to be misread.
        """
        for info in infos:
            try:
                self._told, self.mount = Lens.of(info), info.mount
            except LensError:
                continue

    def of_frame(self, width: int, height: int) -> Lens:
        """The lens to read pictures of that size with."""
        return self._told or Lens.assumed(width, height, self._fov_deg)

    def misfit(self, width: int, height: int) -> str | None:
        """Why angles in pictures of that size are off: of another shape than the lens was told for. None where they are not.

        Where the picture was cut, and so where its axis is, no message tells.
        """
        told = self._told
        if told is None or abs(width * told.height / (height * told.width) - 1) < ASPECT_TOLERANCE:
            return None
        return (
            f"camera/info tells a lens for {told.width} x {told.height}, camera/frame is {width} x {height}, "
            "of another aspect ratio: angles are off"
        )

    @property
    def note(self) -> str | None:
        """For the stage's health: why the lens is only assumed; none once the camera has told it."""
        if self._told is not None:
            return None
        return f"no intrinsics from camera/info yet: a lens {self._fov_deg:g} degrees wide is assumed"
