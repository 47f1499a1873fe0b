"""Options of what is drawn, and the core that they make."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

from deixis_cli.options import CommandError, read_site
from deixis_runtime.occupancy_map import wall_lines
from deixis_runtime.site import Site, SiteError
from deixis_schemas.messages import RobotPose

from .known import Known
from .scene import Scene

DEFAULT_RATE_HZ, MOST_RATE_HZ = 10.0, 60.0
DEFAULT_WIDTH, LEAST_WIDTH, MOST_WIDTH = 640, 64, 1920
UNWANTED = "not wanted (--no-pictures)"


@dataclass(frozen=True)
class DrawOptions:
    """rate_hz: frames drawn a second. width: of the pictures, pixels. pictures: whether there are any."""

    rate_hz: float = DEFAULT_RATE_HZ
    width: int = DEFAULT_WIDTH
    pictures: bool = True


def add_draw_options(parser: argparse.ArgumentParser) -> None:
    """--site, --rate, --width and --no-pictures."""
    parser.add_argument("--site", type=Path, metavar="FILE", help="site file: its walls and points of interest are drawn")
    parser.add_argument(
        "--rate",
        type=_rate,
        default=DEFAULT_RATE_HZ,
        metavar="HZ",
        help="most frames drawn a second (default: %(default)s)",
    )
    parser.add_argument(
        "--width", type=_width, default=DEFAULT_WIDTH, metavar="PX", help="pictures are made this wide (default: %(default)s)"
    )
    parser.add_argument("--no-pictures", action="store_true", help="draw what is seen, but show nobody")


def draw_options(given: argparse.Namespace) -> DrawOptions:
    """What `add_draw_options` reads."""
    return DrawOptions(given.rate, given.width, not given.no_pictures)


def known_place(site_file: Path | None) -> Known:
    """What the site file tells of the place; without one, a robot at the map's origin. Raises CommandError."""
    site = read_site(site_file)
    if site is None:
        return Known(robot=_standing(None))
    try:
        return Known(site.pois, wall_lines(site), _standing(site))
    except SiteError as error:
        raise CommandError(str(error)) from None


def scene_of(known: Known, options: DrawOptions, *, live: bool) -> Scene:
    """The core with these options."""
    unwanted = "" if options.pictures else UNWANTED
    return Scene(known, rate_hz=options.rate_hz, width=options.width, no_pictures=unwanted, live=live)


def _standing(site: Site | None) -> RobotPose:
    """Where the robot stands until it says so itself: as fusion takes it, too."""
    place = site.robot_pose.model_dump() if site is not None else {"x_m": 0.0, "y_m": 0.0, "yaw_deg": 0.0}
    return RobotPose(stage="site", instance="file", stamp_ns=0, **place)


def _rate(text: str) -> float:
    return _between(text, 0.1, MOST_RATE_HZ)


def _width(text: str) -> int:
    return int(_between(text, LEAST_WIDTH, MOST_WIDTH))


def _between(text: str, least: float, most: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not least <= value <= most:
        raise argparse.ArgumentTypeError(f"'{text}' is no number from {least:g} to {most:g}")
    return value
