"""Line-ups: which guest, if any, stands in the place of each stage. The one table of them, and where guests are installed.

A guest of a stage is a command `deixis-STAGE-GUEST` in an environment of its own, for its dependencies conflict with ours.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

CLASSIC = "classic"
LINEUPS: Mapping[str, Mapping[str, str]] = {
    CLASSIC: {},
    "mediapipe": {"tracker": "mediapipe", "headpose": "mediapipe", "gesture": "mediapipe"},
    "mediapipe-tracker": {"tracker": "mediapipe"},
    "mediapipe-headpose": {"headpose": "mediapipe"},
    "mediapipe-gesture": {"gesture": "mediapipe"},
    "mediapipe-faces": {"tracker": "mediapipe", "headpose": "mediapipe"},
}
"""Guests by stage, by the line-up's name; stages that are not named are ours."""
FOLDER = "DEIXIS_GUESTS"
"""Environment variable: the folder with the guests' environments, one each; by default `guests` in that of this Python."""


class LineupError(ValueError):
    """A line-up that cannot start; the text says why and what to do."""


def guest_command(stage: str, guest: str) -> Path:
    """The command of a guest, whether it is there or not."""
    folder = Path(os.environ.get(FOLDER) or Path(sys.prefix) / "guests")
    return folder / guest / "bin" / f"deixis-{stage}-{guest}"


def guests_of(lineup: str) -> dict[str, str]:
    """The guests of a line-up by stage. Raises LineupError for one that is not known, and for guests that are not installed."""
    if lineup not in LINEUPS:
        raise LineupError(f"there is no line-up '{lineup}'; known: {', '.join(LINEUPS)}")
    guests = dict(LINEUPS[lineup])
    for stage, guest in guests.items():
        command = guest_command(stage, guest)
        if not os.access(command, os.X_OK):
            raise LineupError(
                f"line-up '{lineup}': the guest {stage}_{guest} is not installed ('{command}'); 'make guests' does it"
            )
    return guests
