"""Shell of the guest head pose stage: joins tracks with their frame, asks the core, publishes the heads."""

from __future__ import annotations

import os
import sys

import cv2
from deixis_runtime.camera_lens import CameraLens
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.lens import Lens
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Frame, HeadPoses, Tracks

from .config import HeadposeConfig
from .estimator import HeadPoseEstimator
from .joining import Joiner

UNJOINED_S = 1.0


def serve(node: Node, config: HeadposeConfig) -> None:
    """Until shutdown: one HeadPoses per frame that has tracks, also where there is nobody in it."""
    cv2.setNumThreads(1)  # the other stages need the cores
    estimator = HeadPoseEstimator(config)  # first: whoever hears that we are alive may send frames
    infos = node.subscribe(topics.CAMERA_INFO)
    frames = node.subscribe(topics.FRAME, depth=config.frames_kept)
    tracks = node.subscribe(topics.TRACKS, depth=config.frames_kept)
    out = node.publish(topics.HEAD_POSES)
    joiner, lens, joined_s = Joiner(config.frames_kept), CameraLens(config.horizontal_fov_deg), node.monotonic_s()
    while node.wait():
        joiner.add(frames.take_all(), tracks.take_all())
        for why in lens.hear(infos.take_all()):  # after the frames: what the camera said before one of them is then here
            node.count("lenses_refused")
            node.warn("lens", f"{infos.key}: not used: {why}")
        pair = joiner.take()
        if pair is not None:
            frame, seen = pair
            with node.step():
                out.put(_poses(node, estimator, lens.of_frame(frame.width, frame.height), frame, seen))
        if pair is not None or joiner.waits is None:
            joined_s = node.monotonic_s()
        node.note("lens", lens.note)
        lonely = node.monotonic_s() - joined_s > UNJOINED_S
        node.set_state("degraded" if lonely else "ok", _say_lonely(joiner.waits, frames.key) if lonely else "")


def _poses(node: Node, estimator: HeadPoseEstimator, lens: Lens, frame: Frame, seen: Tracks) -> HeadPoses:
    """The heads of a frame; none where it cannot be used, which is counted and said (fusion waits for an answer)."""
    why = ""
    if (seen.width, seen.height) != (frame.width, frame.height):
        why = f"tracks speak of {seen.width} x {seen.height}, the frame is {frame.width} x {frame.height}"
    else:
        try:
            image = decode_image(frame)
        except ImageError as error:
            why = str(error)
    if why:
        node.count("frames_refused")
        key = topics.FRAME.key(node.robot)
        node.warn("frame", f"{key}: frame {frame.seq} of {frame.stage}/{frame.instance} refused: {why}")
        return HeadPoses.derive(frame, node.producer, poses=[])
    poses = estimator.update(image, seen.tracks, lens, frame.run)
    if estimator.left_out:
        node.count("persons_left_out", estimator.left_out)
    return HeadPoses.derive(frame, node.producer, poses=poses)


def _say_lonely(waits: Tracks | None, key: str) -> str:
    which = f"seq {waits.seq} of run {waits.run}" if waits else "an earlier frame"
    return f"tracks come, but not their frames: {which} is no frame of {key} that was heard"


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-headpose-mediapipe`."""
    return run_stage("headpose", HeadposeConfig, serve, named(sys.argv[1:] if argv is None else argv))


def named(argv: list[str]) -> list[str]:
    """The command line with a name for this process that tells it from ours; in lockstep all runs have the same."""
    if any(item.split("=")[0] in ("--instance", "--lockstep") for item in argv):
        return argv
    return [*argv, "--instance", f"mediapipe-{os.getpid()}"]


if __name__ == "__main__":
    sys.exit(main())
