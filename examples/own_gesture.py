"""A gesture stage of one's own in forty lines: who holds a hand still, far out beside the face, points to that side."""

import math
import sys

from deixis_runtime.settings import StageConfig
from deixis_runtime.stage import run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Gesture, Gestures
from pydantic import Field


class Config(StageConfig):
    """Its settings, for --set: lengths in face widths."""

    reach: float = Field(default=1.3, gt=0, description="A hand as far beside the face as this is held out.")
    lowest: float = Field(default=2.2, gt=0, description="And no lower below it than this.")
    still: float = Field(default=1.3, gt=0, description="A hand slower than this rests, face widths a second.")


def gesture(face, hands, config):
    """What one person does, from the tracks of the face and of the hands alone."""
    (x, y), width = face.centroid_px, face.bbox_px[2]
    for hand in hands:
        aside, below = (hand.centroid_px[0] - x) / width, (hand.centroid_px[1] - y) / width
        if abs(aside) > config.reach and below < config.lowest:
            is_held = math.hypot(*hand.velocity_px_s) < config.still * width
            pointed = "point_left" if aside > 0 else "point_right"  # the image's right is the person's own left
            side = hand.kind.removesuffix("_hand") if hand.kind != "unknown" else None
            phase, said = ("stroke", pointed) if is_held else ("preparation", "none")
            return Gesture(person_id=face.person_id, phase=phase, gesture=said, hand=side)
    return Gesture(person_id=face.person_id, phase="idle", gesture="none")


def serve(node, config):
    """Answer each Tracks with Gestures until told to stop."""
    tracks, out = node.subscribe(topics.TRACKS), node.publish(topics.GESTURES)
    while node.wait():
        if (seen := tracks.take()) is not None:
            of = {track.person_id: track for track in seen.tracks if track.kind == "face" and track.bbox_px[2] > 0}
            hands = [track for track in seen.tracks if track.kind != "face"]
            found = [
                gesture(of[who], [hand for hand in hands if hand.person_id == who], config) for who in of if who is not None
            ]
            out.put(Gestures.derive(seen, node.producer, gestures=found))


if __name__ == "__main__":
    sys.exit(run_stage("gesture", Config, serve))
