"""Shell of the tracker stage: frames in, tracks out."""

from __future__ import annotations

import cv2
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Tracks

from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import FrameRefused, Tracker


def serve(node: Node, config: TrackerConfig) -> None:
    """Run the stage until shutdown."""
    cv2.setNumThreads(1)  # threads of OpenCV cost the other stages more than they gain here
    frames = node.subscribe(topics.FRAME)
    out = node.publish(topics.TRACKS)
    tracker = Tracker(config)
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
            else:
                if tracker.left_out:
                    node.count("persons_left_out", tracker.left_out)
                    node.warn("persons", f"more people are seen than max_persons: {config.max_persons} are followed")
            node.note("camera", "the camera moves: the room is followed" if tracker.camera_moves else None)
            node.note("colour", "the picture is grey: hands are found by their shape alone" if tracker.is_grey else None)
            said = {"width": frame.width, "height": frame.height, "room_offset_px": tracker.room_offset_px}
            out.put(Tracks.derive(frame, node.producer, tracks=tracks, **said))


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-tracker`."""
    return run_stage("tracker", TrackerConfig, serve, argv)
