"""The headpose stage: joins tracks with their frame, asks the core, publishes the heads of each frame."""

from __future__ import annotations

import cv2
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Frame, HeadPoses, Tracks

from .config import HeadposeConfig
from .estimator import HeadPoseEstimator
from .joining import FrameJoiner


def serve(node: Node, config: HeadposeConfig) -> None:
    """Until shutdown: one HeadPoses per frame that has tracks, also where there is nobody in it."""
    cv2.setNumThreads(1)  # pictures this small are slower on a pool of threads, and the other stages need the cores
    frames = node.subscribe(topics.FRAME, depth=config.frames_kept)
    tracks = node.subscribe(topics.TRACKS, depth=config.frames_kept)
    out = node.publish(topics.HEAD_POSES)
    joiner = FrameJoiner(config.frames_kept)
    estimator = HeadPoseEstimator(config)
    while node.wait():
        joiner.add_frames(frames.take_all())
        joiner.add_tracks(tracks.take_all())
        pair = joiner.take()
        if pair is None:
            continue
        with node.step():
            out.put(_poses(node, estimator, *pair))


def _poses(node: Node, estimator: HeadPoseEstimator, frame: Frame, tracks: Tracks) -> HeadPoses:
    """The heads of a frame; none where its picture cannot be used, which is counted and said (fusion waits for an answer)."""
    try:
        image = decode_image(frame)
    except ImageError as error:
        node.count("frames_unreadable")
        node.warn("unreadable frame", f"frame {frame.seq} of {frame.stage}/{frame.instance}: {error}")
        return HeadPoses.derive(frame, node.producer, poses=[])
    if (tracks.width, tracks.height) != (frame.width, frame.height):
        node.count("tracks_of_other_size")
        node.warn(
            "tracks of other size",
            f"tracks of {tracks.stage}/{tracks.instance} speak of {tracks.width} x {tracks.height}, "
            f"frame {frame.seq} is {frame.width} x {frame.height}",
        )
        return HeadPoses.derive(frame, node.producer, poses=[])
    poses = estimator.update(image, tracks.tracks, frame.run, frame.stamp_ns)
    return HeadPoses.derive(frame, node.producer, poses=poses)


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-headpose`."""
    return run_stage("headpose", HeadposeConfig, serve, argv, "Frames and tracks to head yaw.")


if __name__ == "__main__":
    raise SystemExit(main())
