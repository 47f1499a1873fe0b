"""What a camera owes: frames whose numbers and stamps rise, and its lens. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from deixis_schemas.messages import Frame

from .observation import Phase, decoded
from .results import Result, judged

DELIVER = "does its source deliver? See its log"
NUMBER = "number the frames of a run upward; begin another run where the source begins anew"
STAMP = "stamp each frame with the time of its capture"
TELL_LENS = "publish camera/info, and answer gets on it: without it nobody can be placed"
BY_GET = "answer gets on camera/info with one CameraInfo: who starts later has missed what was published"


def check_camera(phases: Sequence[Phase], told: int, replies: int) -> list[Result]:
    """told: how often the lens was published; replies: how many answers a get of it has."""
    good, _ = decoded([item for phase in phases for item in phase.heard])
    frames = [(item.at_s, message) for item, message in good if isinstance(message, Frame)]
    if not frames:
        return [Result("frames", "failed", "no frame was heard", DELIVER)]
    by_run: dict[int, list[int]] = {}
    for _, frame in frames:
        by_run.setdefault(frame.run, []).append(frame.seq)
    rising = all(sooner < later for seqs in by_run.values() for sooner, later in pairwise(seqs))
    stamped = all(sooner.stamp_ns < later.stamp_ns for (_, sooner), (_, later) in pairwise(frames))
    long_s = frames[-1][0] - frames[0][0]
    rate = f", {(len(frames) - 1) / long_s:.1f} a second" if long_s > 0 else ""
    return [
        Result("frames", "passed", f"{len(frames)} frames{rate}"),
        judged("numbers", "`seq` rises within each run", None if rising else "`seq` does not rise within a run", NUMBER),
        judged("stamps", "stamps rise", None if stamped else "stamps do not rise", STAMP),
        judged("lens", "tells its lens", None if told else "publishes no lens", TELL_LENS),
        judged(
            "lens by get", "tells it to a get", None if replies == 1 else f"{replies} answers to a get of camera/info", BY_GET
        ),
    ]
