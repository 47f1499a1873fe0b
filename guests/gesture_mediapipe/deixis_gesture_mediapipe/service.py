"""Shell of the guest gesture stage: tracks and the pictures that they speak of in, gestures out."""

from __future__ import annotations

import os
import sys
from collections import OrderedDict
from collections.abc import Iterable

import cv2
from deixis_runtime.camera_lens import CameraLens
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Frame, FrameId, Gestures, Tracks

from .config import GestureConfig
from .reader import HandReader, Picture
from .recognizer import GestureRecognizer

FRAMES_KEPT = 8
NO_PICTURES = "tracks come without the pictures that they speak of: fingers are not read, no pointing is told by them"


def serve(node: Node, config: GestureConfig) -> None:
    """Answer each Tracks with Gestures until the stage has to stop."""
    cv2.setNumThreads(1)  # the other stages need the cores
    reader, recognizer = HandReader(config), GestureRecognizer(config)  # first: models take a second to load
    infos = node.subscribe(topics.CAMERA_INFO)
    frames = node.subscribe(topics.FRAME, depth=FRAMES_KEPT)
    tracks = node.subscribe(topics.TRACKS)
    out = node.publish(topics.GESTURES)
    lens, held = CameraLens(config.horizontal_fov_deg), HeldFrames()
    seen: Tracks | None = None
    due_s = 0.0
    while node.wait(config.frame_wait_s / 4 if seen is not None else 0.25):
        newer = tracks.take()
        if newer is not None:
            seen, due_s = newer, node.monotonic_s() + config.frame_wait_s
        held.add(frames.take_all())  # after the tracks: the frame that they speak of came before them
        for why in lens.hear(infos.take_all()):
            node.count("lenses_refused")
            node.warn("lens", f"{infos.key}: not used: {why}")
        node.note("lens", lens.note)
        if seen is None or (not held.has(seen.frame_id) and node.monotonic_s() < due_s):
            continue
        frame = held.take(seen.frame_id)
        if frame is None:
            node.count("tracks_without_frame")
        node.set_state("ok" if frame is not None else "degraded", "" if frame is not None else NO_PICTURES)
        with node.step():
            reader.begin(_picture(node, frame) if frame is not None else None)
            found = recognizer.update(seen, lens.of_frame(seen.width, seen.height), lens.mount, reader.read)
            reader.end()
            out.put(Gestures.derive(seen, node.producer, gestures=found))
        if reader.left_out:
            node.count("hands_left_out", reader.left_out)
        seen = None


class HeldFrames:
    """The last few frames, by name."""

    def __init__(self) -> None:
        self._frames: OrderedDict[FrameId, Frame] = OrderedDict()

    def add(self, frames: Iterable[Frame]) -> None:
        """Keep frames, in the order they came; the oldest go."""
        for frame in frames:
            self._frames[frame.frame_id] = frame
            while len(self._frames) > FRAMES_KEPT:
                self._frames.popitem(last=False)

    def has(self, frame_id: FrameId) -> bool:
        """Whether that frame is here."""
        return frame_id in self._frames

    def take(self, frame_id: FrameId) -> Frame | None:
        """That frame; those before it go as well."""
        if frame_id not in self._frames:
            return None
        while (first := self._frames.popitem(last=False))[0] != frame_id:
            pass
        return first[1]


def _picture(node: Node, frame: Frame) -> Picture | None:
    try:
        return decode_image(frame)
    except ImageError as error:
        node.count("frames_refused")
        key = topics.FRAME.key(node.robot)
        node.warn("frame", f"{key}: frame {frame.seq} of {frame.stage}/{frame.instance} refused: {error}")
        return None


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-gesture-mediapipe`."""
    return run_stage("gesture", GestureConfig, serve, named(sys.argv[1:] if argv is None else argv))


def named(argv: list[str]) -> list[str]:
    """The command line with a name for this process that tells it from ours; in lockstep all runs have the same."""
    if any(item.split("=")[0] in ("--instance", "--lockstep") for item in argv):
        return argv
    return [*argv, "--instance", f"mediapipe-{os.getpid()}"]


if __name__ == "__main__":
    sys.exit(main())
