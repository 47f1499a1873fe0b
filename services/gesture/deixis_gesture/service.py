"""The gesture stage: tracks in, gestures out, one message for each frame."""

from __future__ import annotations

from deixis_runtime.camera_lens import CameraLens
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Gesture, Gestures, Tracks

from .config import GestureConfig
from .recognizer import GestureRecognizer


def serve(node: Node, config: GestureConfig) -> None:
    """Answer each Tracks with Gestures until the stage has to stop."""
    infos = node.subscribe(topics.CAMERA_INFO)
    tracks = node.subscribe(topics.TRACKS)
    out = node.publish(topics.GESTURES)
    recognizer = GestureRecognizer(config)
    lens = CameraLens(config.horizontal_fov_deg)
    while node.wait():
        seen = tracks.take()
        for why in lens.hear(infos.take_all()):  # after taking the tracks: what the camera said before their frame is then here
            node.count("lenses_refused")
            node.warn("lens", f"{infos.key}: not used: {why}")
        if seen is not None:
            with node.step():
                out.put(Gestures.derive(seen, node.producer, gestures=_gestures(recognizer, seen, lens)))
        node.note("lens", lens.note)


def _gestures(recognizer: GestureRecognizer, seen: Tracks, lens: CameraLens) -> list[Gesture]:
    size = (seen.width, seen.height)
    through = lens.of_frame(*size)
    return recognizer.update(seen.tracks, *size, through, seen.run, seen.stamp_ns, seen.room_offset_px, lens.mount)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `deixis-gesture`."""
    return run_stage("gesture", GestureConfig, serve, argv)
