"""`deixis calibrate`: measures what a system has to know of its camera."""

from __future__ import annotations

from typing import Any

from . import board_command, camera_command, site_command


def register(subparsers: Any) -> None:
    """Add the command with its own subcommands."""
    parser = subparsers.add_parser("calibrate", help="measure the camera: its lens, how it is mounted", description=__doc__)
    parts = parser.add_subparsers(metavar="WHAT", required=True)
    board_command.register(parts)
    camera_command.register(parts)
    site_command.register(parts)
