"""Who speaks while a clip is played: the robot of a moving camera, and the truth in place of the stages chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .camera_pose import path_of
from .clips import Clip
from .robot_way import RobotWay
from .speaker import Speaker
from .true_gestures import TrueGestures
from .true_heads import TrueHeads
from .true_tracks import TrueTracks, label_pictures_of

STAND_INS: dict[str, Callable[[Clip], Speaker]] = {
    "tracker": TrueTracks,
    "headpose": lambda clip: TrueHeads(clip.truth),
    "gesture": lambda clip: TrueGestures(clip.truth),
}
"""The stages whose answers the truth can take the place of."""


def read_stages(text: str) -> tuple[str, ...]:
    """Stages of a list with commas, in the order of the chain. Raises ValueError for one that the truth cannot stand for."""
    wanted = {name.strip() for name in text.split(",") if name.strip()}
    unknown = sorted(wanted - STAND_INS.keys())
    if unknown or not wanted:
        raise ValueError(f"the truth cannot stand for {', '.join(unknown) or 'nothing'}; known: {', '.join(STAND_INS)}")
    return tuple(name for name in STAND_INS if name in wanted)


def speakers_for(clip: Clip, truth: Sequence[str], *, lockstep: bool) -> list[Speaker]:
    """Those who speak beside the stages that run. Raises ClipError for labels that they cannot use."""
    path = path_of(clip.truth)
    robot: list[Speaker] = [RobotWay(path, clip.truth.meta.fps, lockstep=lockstep)] if path else []
    return robot + [STAND_INS[stage](clip) for stage in truth]


def say_blind(clips: Sequence[Clip], truth: Sequence[str]) -> str | None:
    """What true tracks lack where label pictures are missing; none where nothing is."""
    without = [clip.name for clip in clips if not label_pictures_of(clip).exists()] if "tracker" in truth else []
    if not without:
        return None
    return (
        f"no label pictures (NAME_labels.npz) beside {len(without)} of {len(clips)} clips, e.g. {without[0]}: "
        "true tracks have hands without outlines there, and the gesture stage does not see them"
    )
