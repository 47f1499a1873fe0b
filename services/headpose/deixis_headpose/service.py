"""The headpose stage: joins tracks with the frame they speak of, asks the core, publishes the heads of each frame."""

from __future__ import annotations

import cv2
from deixis_runtime.camera_lens import CameraLens
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.lens import Lens
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Frame, HeadPoses, Tracks

from .config import HeadposeConfig
from .estimator import HeadPoseEstimator
from .joining import FrameJoiner


def serve(node: Node, config: HeadposeConfig) -> None:
    """Until shutdown: one HeadPoses per frame that has tracks, also where there is nobody in it."""
    cv2.setNumThreads(1)  # pictures this small are slower on a pool of threads, and the other stages need the cores
    infos = node.subscribe(topics.CAMERA_INFO)
    frames = node.subscribe(topics.FRAME, depth=config.frames_kept)
    tracks = node.subscribe(topics.TRACKS, depth=config.frames_kept)
    out = node.publish(topics.HEAD_POSES)
    joiner = FrameJoiner(config.frames_kept)
    estimator = HeadPoseEstimator(config)
    lens = CameraLens(config.horizontal_fov_deg)
    while node.wait():
        joiner.add_frames(frames.take_all())
        joiner.add_tracks(tracks.take_all())
        for why in lens.hear(infos.take_all()):  # after taking the frames: what the camera said before one of them is then here
            node.count("lenses_refused")
            node.warn("lens", f"{infos.key}: not used: {why}")
        pair = joiner.take()
        if pair is not None:
            frame = pair[0]
            with node.step():
                out.put(_poses(node, estimator, lens.of_frame(frame.width, frame.height), *pair))
        for name, count in joiner.take_dropped().items():
            node.count(name, count)
        node.note("lens", lens.note)
        unjoined = unjoined_reason(joiner, node.robot, config.frames_kept)
        node.set_state("degraded" if unjoined else "ok", unjoined or "")


def unjoined_reason(joiner: FrameJoiner, robot: str, frames_kept: int) -> str | None:
    """Why tracks that come are not answered, with the keys; none while they are."""
    tracks, newest = joiner.unjoined, joiner.newest_frame
    if tracks is None:
        return None
    frames_key, who = topics.FRAME.key(robot), f"{topics.TRACKS.key(robot)} by {tracks.stage}/{tracks.instance}"
    if joiner.came(tracks.frame_id):
        return f"{who} comes when its frame is no longer among the last {frames_kept} (frames_kept) of {frames_key}"
    last = f"the last is seq {newest.seq} of run {newest.run}" if newest else "none has come"
    return f"{who} speaks of seq {tracks.seq} of run {tracks.run}, which is no frame of {frames_key}: {last}"


def _poses(node: Node, estimator: HeadPoseEstimator, lens: Lens, frame: Frame, tracks: Tracks) -> HeadPoses:
    """The heads of a frame; none where its picture cannot be used, which is counted and said (fusion waits for an answer)."""
    try:
        image = decode_image(frame)
    except ImageError as error:
        node.count("frames_unreadable")
        key = topics.FRAME.key(node.robot)
        node.warn("unreadable frame", f"{key}: frame {frame.seq} of {frame.stage}/{frame.instance}: {error}")
        return HeadPoses.derive(frame, node.producer, poses=[])
    if (tracks.width, tracks.height) != (frame.width, frame.height):
        node.count("tracks_of_other_size")
        node.warn(
            "tracks of other size",
            f"{topics.TRACKS.key(node.robot)}: {tracks.stage}/{tracks.instance} speaks of {tracks.width} x {tracks.height}, "
            f"frame {frame.seq} is {frame.width} x {frame.height}",
        )
        return HeadPoses.derive(frame, node.producer, poses=[])
    poses = estimator.update(image, tracks.tracks, lens, frame.run, frame.stamp_ns)
    return HeadPoses.derive(frame, node.producer, poses=poses)


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-headpose`."""
    return run_stage("headpose", HeadposeConfig, serve, argv, "Frames and tracks to head yaw.")


if __name__ == "__main__":
    raise SystemExit(main())
