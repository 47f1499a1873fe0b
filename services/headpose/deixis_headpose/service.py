"""The headpose stage: joins tracks with the frame they speak of, asks the core, publishes the heads of each frame."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Iterable

import cv2
from deixis_runtime.camera_lens import CameraLens
from deixis_runtime.images import ImageError, decode_image
from deixis_runtime.lens import Lens
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import Frame, FrameId, HeadPoses, Tracks

from .config import HeadposeConfig
from .estimator import HeadPoseEstimator


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
        lens.hear(infos.take_all())  # after taking the frames: what the camera said before one of them is then here
        node.note("lens", lens.note)
        pair = joiner.take()
        if pair is None:
            continue
        frame = pair[0]
        with node.step():
            out.put(_poses(node, estimator, lens.of_frame(frame.width, frame.height), *pair))


class FrameJoiner:
    """Keeps the last few frames and the last few tracks, and gives the newest pair of the same run and `seq`.

    A pair is given once, and never one that is older than one already given, except from a camera that started anew.
    """

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._frames: OrderedDict[FrameId, Frame] = OrderedDict()
        self._waiting: deque[Tracks] = deque(maxlen=kept)

    def add_frames(self, frames: Iterable[Frame]) -> None:
        """Keep frames, in the order they came; the oldest go."""
        for frame in frames:
            self._frames[frame.frame_id] = frame
            self._frames.move_to_end(frame.frame_id)
            while len(self._frames) > self._kept:
                self._frames.popitem(last=False)

    def add_tracks(self, tracks: Iterable[Tracks]) -> None:
        """Keep tracks, in the order they came; either of frame and tracks may come first."""
        self._waiting.extend(tracks)

    def take(self) -> tuple[Frame, Tracks] | None:
        """The newest tracks whose frame is held, with that frame; what came before them is dropped. None: no pair yet."""
        for index in reversed(range(len(self._waiting))):
            tracks = self._waiting[index]
            frame = self._frames.get(tracks.frame_id)
            if frame is not None:
                self._drop_up_to(index, tracks.frame_id)
                return frame, tracks
        return None

    def _drop_up_to(self, index: int, frame_id: FrameId) -> None:
        for _ in range(index + 1):
            self._waiting.popleft()
        while next(iter(self._frames)) != frame_id:
            self._frames.popitem(last=False)
        del self._frames[frame_id]


def _poses(node: Node, estimator: HeadPoseEstimator, lens: Lens, frame: Frame, tracks: Tracks) -> HeadPoses:
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
    poses = estimator.update(image, tracks.tracks, lens, frame.run, frame.stamp_ns)
    return HeadPoses.derive(frame, node.producer, poses=poses)


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-headpose`."""
    return run_stage("headpose", HeadposeConfig, serve, argv, "Frames and tracks to head yaw.")


if __name__ == "__main__":
    raise SystemExit(main())
