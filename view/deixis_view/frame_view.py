"""What is known of one frame."""

from __future__ import annotations

from dataclasses import dataclass

from deixis_schemas.messages import Belief, Frame, FrameId, Gestures, HeadPoses, Tracks


@dataclass
class FrameView:
    """One frame, and what the stages have said of it so far."""

    frame_id: FrameId
    stamp_ns: int
    frame: Frame | None = None
    tracks: Tracks | None = None
    poses: HeadPoses | None = None
    gestures: Gestures | None = None
    belief: Belief | None = None
