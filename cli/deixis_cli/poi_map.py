"""What a page about a site draws below the points of interest: its map as a picture, its walls, where the robot begins."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from deixis_runtime.site import Site, SiteError, WallLine

from .options import CommandError

MAX_PICTURE_SIDE = 4096
"""Of the picture that is sent, pixels: a tablet's browser draws no larger one."""


@dataclass(frozen=True)
class SiteMap:
    """What is drawn of a site. `picture` is a PNG, empty without a map; its lower left corner is at `origin` in the map frame
    (x, y in metres, yaw in radians), its size is `size_m` (width, height).
    """

    name: str = ""
    robot_pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
    walls: list[WallLine] = field(default_factory=list)
    picture: bytes = b""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    size_m: tuple[float, float] = (0.0, 0.0)

    def described(self) -> dict[str, Any]:
        """All but the picture, for JSON: metres in the map frame, the robot's heading in degrees."""
        picture = {"origin": self.origin, "size_m": self.size_m} if self.picture else None
        return {"name": self.name, "robot_pose": self.robot_pose, "walls": self.walls, "picture": picture}


def site_map(site: Site | None) -> SiteMap:
    """What is drawn of a site; nothing without one. Raises CommandError where its map cannot be read."""
    if site is None:
        return SiteMap()
    pose = (site.robot_pose.x_m, site.robot_pose.y_m, site.robot_pose.yaw_deg)
    plain = SiteMap(site.name, pose, site.wall_lines)
    return _with_picture(site, plain) if site.map else plain


def _with_picture(site: Site, plain: SiteMap) -> SiteMap:
    try:
        # Here, for the command is installed without OpenCV where no stage needs it.
        import cv2  # noqa: PLC0415
        from deixis_runtime.occupancy_map import read_map, shades  # noqa: PLC0415
    except ImportError as error:
        raise CommandError(f"the site's map needs 'deixis-runtime[images]' installed: {error}") from None
    try:
        described, picture = read_map(site.path.parent / site.map)
    except SiteError as error:
        raise CommandError(str(error)) from None
    drawn = shades(picture, described)
    height, width = drawn.shape
    size_m = (width * described.resolution, height * described.resolution)
    scale = MAX_PICTURE_SIDE / max(drawn.shape)
    if scale < 1:
        smaller = (max(1, round(width * scale)), max(1, round(height * scale)))
        _, packed = cv2.imencode(".png", cv2.resize(drawn, smaller, interpolation=cv2.INTER_AREA))
    else:
        _, packed = cv2.imencode(".png", drawn)
    return SiteMap(plain.name, plain.robot_pose, plain.walls, packed.tobytes(), described.origin, size_m)
