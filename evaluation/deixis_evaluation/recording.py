"""What the system published about one clip, read back from the recorder's JSON lines and put in order by frame."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from deixis_schemas.messages import (
    Belief,
    Frame,
    Gesture,
    Gestures,
    HeadPose,
    HeadPoses,
    Health,
    Message,
    OfFrame,
    Target,
    Track,
    Tracks,
)
from pydantic import ValidationError


class RecordingError(ValueError):
    """A recording that cannot be read; the text names the file and the line."""


@dataclass
class Recording:
    """Messages by the `seq` of their frame, which within one run is the frame's index in the clip.

    runs: those of the camera that were heard; a clip is played in one. frame_ns, belief_ns: when frame and belief were
    received, Unix ns. stamps_ns: the frames' own stamps. targets: final ones. pids: processes that each stage has had.
    """

    runs: set[int] = field(default_factory=set)
    frame_ns: dict[int, int] = field(default_factory=dict)
    belief_ns: dict[int, int] = field(default_factory=dict)
    stamps_ns: dict[int, int] = field(default_factory=dict)
    tracks: dict[int, Tracks] = field(default_factory=dict)
    poses: dict[int, HeadPoses] = field(default_factory=dict)
    gestures: dict[int, Gestures] = field(default_factory=dict)
    beliefs: dict[int, Belief] = field(default_factory=dict)
    targets: list[Target] = field(default_factory=list)
    pids: dict[str, set[int]] = field(default_factory=dict)

    def add(self, message: Message, received_ns: int) -> None:
        """Sort in one message; of no interest are those that speak of no frame, and updates of targets."""
        if isinstance(message, OfFrame):
            self.runs.add(message.run)
        if isinstance(message, Tracks):
            self.tracks[message.seq] = message
        elif isinstance(message, HeadPoses):
            self.poses[message.seq] = message
        elif isinstance(message, Gestures):
            self.gestures[message.seq] = message
        elif isinstance(message, Belief):
            self.beliefs[message.seq] = message
            self.belief_ns.setdefault(message.seq, received_ns)
            self.stamps_ns[message.seq] = message.stamp_ns
        elif isinstance(message, Target) and message.final:
            self.targets.append(message)
        elif isinstance(message, Health):
            self.pids.setdefault(message.stage, set()).add(message.pid)

    @property
    def interruption(self) -> str | None:
        """Why this is not one playing of the clip: what was half seen twice is not what the stages would have answered."""
        restarted = sorted(stage for stage, pids in self.pids.items() if len(pids) > 1)
        if restarted:
            return f"restarted while the clip was played: {', '.join(restarted)}"
        return f"the camera began {len(self.runs)} runs of the clip" if len(self.runs) > 1 else None

    def add_frame(self, run: int, seq: int, stamp_ns: int, received_ns: int) -> None:
        """Note that a frame was published."""
        self.runs.add(run)
        self.frame_ns[seq] = received_ns
        self.stamps_ns[seq] = stamp_ns

    def tracks_at(self, frame: int) -> list[Track]:
        """Tracks of a frame; none where the tracker did not answer it."""
        return self.tracks[frame].tracks if frame in self.tracks else []

    def poses_at(self, frame: int) -> list[HeadPose]:
        """Head poses of a frame."""
        return self.poses[frame].poses if frame in self.poses else []

    def gestures_at(self, frame: int) -> list[Gesture]:
        """Gestures of a frame."""
        return self.gestures[frame].gestures if frame in self.gestures else []

    def frame_at(self, stamp_ns: int) -> float:
        """Place in the clip, in frames, of a time on the camera's clock: between the frames whose stamps enclose it."""
        known = sorted((stamp, seq) for seq, stamp in self.stamps_ns.items())
        if not known:
            return -1.0
        before = [item for item in known if item[0] <= stamp_ns]
        after = [item for item in known if item[0] >= stamp_ns]
        (first_ns, first), (last_ns, last) = (before or after)[-1 if before else 0], (after or before)[0 if after else -1]
        return first + (last - first) * (stamp_ns - first_ns) / (last_ns - first_ns) if last_ns > first_ns else float(first)


SCORED: dict[str, type[Message]] = {cls.__name__: cls for cls in (Tracks, HeadPoses, Gestures, Belief, Target, Health)}


def read_recording(path: Path) -> Recording:
    """Read a recorder's file. Raises RecordingError."""
    recording = Recording()
    try:
        with path.open(encoding="utf-8") as lines:
            for number, line in enumerate(lines, 1):
                _read_line(recording, line, f"recording '{path}' line {number}")
    except OSError as error:
        raise RecordingError(f"recording '{path}' cannot be read: {error.strerror}") from None
    return recording


def _read_line(recording: Recording, line: str, where: str) -> None:
    try:
        entry: dict[str, Any] = json.loads(line)
        if entry["type"] == Frame.__name__:
            recording.add_frame(entry["message"]["run"], entry["seq"], entry["stamp_ns"], entry["received_ns"])
        elif entry["type"] in SCORED:
            message = SCORED[entry["type"]].model_validate_json(json.dumps(entry["message"]))
            recording.add(message, entry["received_ns"])
    except ValidationError as error:
        raise RecordingError(f"{where}: {error.error_count()} bad fields, the first {error.errors()[0]['loc']}") from None
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(f"{where}: not a line of a recording: {error!r}") from None
