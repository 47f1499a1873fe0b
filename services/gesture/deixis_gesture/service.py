"""The gesture stage: tracks in, gestures out, one message for each frame."""

from __future__ import annotations

from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Gestures

from .config import GestureConfig
from .recognizer import GestureRecognizer


def serve(node: Node, config: GestureConfig) -> None:
    """Answer each Tracks with Gestures until the stage has to stop."""
    tracks = node.subscribe(topics.TRACKS)
    out = node.publish(topics.GESTURES)
    recognizer = GestureRecognizer(config)
    while node.wait():
        seen = tracks.take()
        if seen is None:
            continue
        with node.step():
            gestures = recognizer.update(seen.tracks, seen.width, seen.height, seen.run, seen.stamp_ns)
            out.put(Gestures.derive(seen, node.producer, gestures=gestures))


def main(argv: list[str] | None = None) -> int:
    """Entry point of `deixis-gesture`."""
    return run_stage("gesture", GestureConfig, serve, argv)
