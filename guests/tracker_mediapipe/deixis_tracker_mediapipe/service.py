"""Shell of the guest tracker: frames in, tracks out."""

from __future__ import annotations

import os
import sys

import cv2
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Tracks

from .config import TrackerConfig
from .tracker import FrameRefused, Tracker


def serve(node: Node, config: TrackerConfig) -> None:
    """Run the stage until shutdown."""
    cv2.setNumThreads(1)  # the other stages need the cores
    tracker = Tracker(config)  # first: its models take a second to load, and whoever hears that we are alive may send frames
    frames = node.subscribe(topics.FRAME)
    out = node.publish(topics.TRACKS)
    while node.wait():
        frame = frames.take()
        if frame is None:
            continue
        with node.step():
            try:
                tracks = tracker.update(decode_image(frame), frame.run, frame.stamp_ns)
            except (ImageError, FrameRefused) as error:
                node.count("frames_refused")
                node.warn("frame", f"{frames.key}: frame {frame.seq} of {frame.stage}/{frame.instance} refused: {error}")
                tracks = []  # fusion still waits for an answer to this frame
            if left_out := tracker.persons.left_out:
                node.count("persons_left_out", left_out)
                node.warn("persons", f"more people are seen than max_persons: {config.max_persons} are followed")
            said = {"width": frame.width, "height": frame.height, "room_offset_px": tracker.room.offset_px}
            out.put(Tracks.derive(frame, node.producer, tracks=tracks, **said))


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-tracker-mediapipe`."""
    return run_stage("tracker", TrackerConfig, serve, named(sys.argv[1:] if argv is None else argv))


def named(argv: list[str]) -> list[str]:
    """The command line with a name for this process that tells it from ours; in lockstep all runs have the same."""
    if any(item.split("=")[0] in ("--instance", "--lockstep") for item in argv):
        return argv
    return [*argv, "--instance", f"mediapipe-{os.getpid()}"]


if __name__ == "__main__":
    sys.exit(main())
