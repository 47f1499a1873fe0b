"""A head pose stage of one's own in the place of deixis-headpose: what a stage has to do, in plain Python.

It estimates coarsely: hair is darker than skin, and shows on the side of the face box that the face has turned from. How far
the dark moves from where it was in a person's first frames gives the yaw; people are taken to begin facing the camera.

With DEIXIS_STAND_BY=1 it comes up unheard, and `deixis swap` gives it the place of the stage that runs.
"""

import argparse
import json
import math
import os
import signal
import sys
import time
from collections import defaultdict

import numpy as np
import zenoh
from changing_places import Place
from deixis_runtime.age import RelativeAge
from deixis_runtime.images import decode_image
from deixis_schemas import Producer, codec, topics
from deixis_schemas.anatomy import FACE_WIDTH_M, HEAD_WIDTH_M
from deixis_schemas.messages import HeadPoses

FRAMES_TO_START = 10
SINE_PER_OFFSET = -2.1  # fitted on labelled head turns: offset in half box widths to the sine of the yaw
MAX_SINE, SIGMA_DEG = 0.97, 15.0


def dark_offset(picture, box):
    """Where the dark lies on the head with this face box, -1 its left edge to 1 its right; None: nothing to see."""
    x, y, w, h = box
    wider = (HEAD_WIDTH_M / FACE_WIDTH_M - 1) * w
    x, y, w, h = (max(0, round(v)) for v in (x - wider / 2, y, w + wider, h))
    grey = picture[y : y + h, x : x + w].mean(axis=2)
    if min(grey.shape) < 8:
        return None
    dark = np.clip(np.median(grey) - grey, 0, None).sum(axis=0)
    return float(dark @ np.linspace(-1, 1, dark.size) / max(dark.sum(), 1e-9))


def head_pose(person_id, offset, first):
    """The HeadPose of one person; `first` collects the offsets of the first frames."""
    if offset is None:
        return {"person_id": person_id, "status": "lost"}
    if len(first) < FRAMES_TO_START:
        first.append(offset)
        return {"person_id": person_id, "status": "initialising"}
    sine = SINE_PER_OFFSET * (offset - np.median(first))
    if abs(sine) > MAX_SINE:
        return {"person_id": person_id, "status": "out_of_range", "side": "left" if sine > 0 else "right"}
    yaw_deg = math.degrees(math.asin(sine))
    return {"person_id": person_id, "status": "tracking", "yaw_deg": yaw_deg, "yaw_sigma_deg": SIGMA_DEG}


def read(topic, sample):
    """The message in a sample; None, and a word about it, where it breaks the contract."""
    try:
        return codec.decode(topic.type, sample.payload.to_bytes(), str(sample.encoding), max_bytes=topic.max_bytes)
    except codec.CodecError as error:
        print(f"{sample.key_expr}: {error}", file=sys.stderr)
        return None


def open_session(endpoint, within_s):
    """A client session of the router at `endpoint`, which may still be starting; ends the process where none comes in time."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    try:
        config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    except zenoh.ZError:
        sys.exit(f"swap_headpose: --connect: '{endpoint}' is no endpoint: tcp/HOST:PORT or unixsock-stream/PATH")
    config.insert_json5("scouting/multicast/enabled", "false")
    until_s, told = time.monotonic() + within_s, False
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if time.monotonic() > until_s:
                sys.exit(f"swap_headpose: no Zenoh router answers at {endpoint} (--connect); start 'deixis run' or 'deixis up'")
        if not told:
            print(f"swap_headpose: waiting {within_s:g} s for a router at {endpoint}", file=sys.stderr, flush=True)
            told = True
        time.sleep(0.2)  # and not Zenoh's own `connect/timeout_ms`: while that waits, Ctrl-C goes unheard


def main():
    """Publish head poses until told to stop."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", required=True)
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", metavar="ENDPOINT", help="default: %(default)s")
    parser.add_argument("--wait", type=float, default=20.0, metavar="S", help="for the router to come (default: %(default)s)")
    given = parser.parse_args()
    producer = Producer("headpose", f"swap-{os.getpid()}")
    stopping = []
    signal.signal(signal.SIGTERM, lambda *_: stopping.append(True))
    with open_session(given.connect, given.wait) as session:
        # Rings keep the newest: whoever is slow works on what is new and never on a backlog.
        frames = session.declare_subscriber(topics.FRAME.key(given.robot), zenoh.handlers.RingChannel(8))
        tracks = session.declare_subscriber(topics.TRACKS.key(given.robot), zenoh.handlers.RingChannel(1))
        infos = session.declare_subscriber(topics.CAMERA_INFO.key(given.robot), zenoh.handlers.RingChannel(1))
        poses = session.declare_publisher(topics.HEAD_POSES.key(given.robot), encoding=codec.encoding_of(HeadPoses))
        aside = session.declare_publisher(
            topics.standby_key(topics.HEAD_POSES, given.robot), encoding=codec.encoding_of(HeadPoses)
        )
        place = Place(session, given.robot, producer, stands_by=os.environ.get("DEIXIS_STAND_BY", "") not in ("", "0"))
        print(f"swap_headpose: alive as {producer.instance}", flush=True)
        held, first, run, age, lockstep = {}, defaultdict(list), None, RelativeAge(), False
        # It is published on change only; who comes later asks for it.
        for reply in session.get(topics.CAMERA_INFO.key(given.robot), timeout=1.0):
            if reply.ok is not None and (info := read(topics.CAMERA_INFO, reply.ok)) is not None:
                lockstep = info.lockstep
        while not (stopping or place.leaving):
            place.answer_questions()
            sample = tracks.try_recv()
            if sample is None:
                time.sleep(0.002)  # and not `recv`: while that waits, no signal is heard
                continue
            seen = read(topics.TRACKS, sample)
            if (sample := infos.try_recv()) is not None and (info := read(topics.CAMERA_INFO, sample)) is not None:
                lockstep = info.lockstep
            while (sample := frames.try_recv()) is not None:
                frame = read(topics.FRAME, sample)
                if frame is not None:
                    held[frame.frame_id] = frame
            held = dict(list(held.items())[-8:])
            if seen is None or seen.frame_id not in held:
                continue
            received_ns = time.monotonic_ns()
            age.note(*seen.frame_id, seen.stamp_ns, received_ns)
            if age.age_s(seen.stamp_ns, received_ns) > topics.TRACKS.max_age_s and not lockstep:
                continue  # what a link that was cut gives out when it is mended; in lockstep the frames wait for us
            if seen.run != run:  # the camera began anew, or the recording plays again: other people, or the same elsewhere
                run, first = seen.run, defaultdict(list)
            frame = held[seen.frame_id]
            picture = decode_image(frame)  # bgr8, mono8, or over a link jpeg
            faces = {track.person_id: track for track in seen.tracks if track.kind == "face" and track.person_id is not None}
            found = [head_pose(who, dark_offset(picture, face.bbox_px), first[who]) for who, face in faces.items()]
            out = poses if place.is_ours(seen.frame_id) else aside
            out.put(codec.encode(HeadPoses.derive(seen, producer, poses=found)))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
