"""The headpose stage as a process, given tracks that nobody should send: it says so, and goes on."""

import sys
import time

import numpy as np
import pytest
from deixis_runtime.session import open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import Frame, FrontalFace, KindProbabilities, Producer, Track, Tracks
from running import answers, command, free_port, get_one, process, wait_until

WIDTH, HEIGHT = 64, 48
NOISE = np.random.default_rng(1).integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8).tobytes()


def frame(seq):
    stamp_ns = time.time_ns()
    return Frame(
        run=5, seq=seq, stamp_ns=stamp_ns, stage="camera", instance="c", width=WIDTH, height=HEIGHT, encoding="bgr8", data=NOISE
    )


def tracks_of(source, face_px=20.0, **numbers):
    face = Track(
        track_id=1,
        person_id=1,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=(32, 24),
        bbox_px=(22, 14, 20, 20),
        velocity_px_s=(0, 0),
        frontal=FrontalFace(centre_px=(32, 24), width_px=face_px),
    )
    tracks = Tracks.derive(source, Producer("tracker", "mine"), width=WIDTH, height=HEIGHT, tracks=[face])
    return tracks.model_copy(update=numbers)


class Stage:
    """A running headpose stage, and what it is given and says."""

    def __init__(self, session, robot, child, log):
        self.session, self.robot, self.child, self.log = session, robot, child, log
        self.seq = 1000
        self.answered = set()
        self._subscriber = session.declare_subscriber(topics.HEAD_POSES.key(robot), self._hear)

    def _hear(self, sample):
        self.answered.add(codec.decode(topics.HEAD_POSES.type, sample.payload.to_bytes(), str(sample.encoding)).seq)

    def put(self, topic, message):
        self.session.put(topic.key(self.robot), codec.encode(message), encoding=codec.encoding_of(type(message)))

    def give(self, **changes):
        """The next frame with its tracks, changed so."""
        self.seq += 1
        shown = frame(self.seq)
        self.put(topics.FRAME, shown)
        self.put(topics.TRACKS, tracks_of(shown, **changes))

    @property
    def health(self):
        return get_one(self.session, topics.HEALTH.key(self.robot, stage="headpose")) or {}

    def wait_until(self, condition, what):
        def checked():
            assert self.child.poll() is None, f"the stage ended:\n{self.log.read_text()}"
            return condition()

        return wait_until(checked, what, 30, self.log)


@pytest.fixture
def stage(tmp_path, robot, request):
    endpoint, log = f"tcp/127.0.0.1:{free_port()}", tmp_path / "headpose"
    argv = [sys.executable, "-m", "deixis_runtime.router", "--listen", endpoint]
    with process(argv, tmp_path / "router"):
        wait_until(lambda: answers(endpoint), "a router", 30)
        settings = ["--set", f"method={getattr(request, 'param', 'regression')}"]
        with (
            process(command("deixis-headpose", "--robot", robot, "--connect", endpoint, *settings), log) as child,
            open_client(endpoint, shared_memory=False) as session,
        ):
            running = Stage(session, robot, child, log)
            running.wait_until(lambda: running.health, "health")
            yield running


def test_a_tracker_with_numbers_of_its_own_is_named_in_health_and_in_the_log_until_it_has_the_cameras(stage):
    def degraded():
        stage.give(seq=stage.seq - 1000)
        health = stage.health
        return health if health["state"] == "degraded" else None

    health = stage.wait_until(degraded, "degraded health")
    assert topics.TRACKS.key(stage.robot) in health["reason"]
    assert topics.FRAME.key(stage.robot) in health["reason"]
    assert "tracker/mine" in health["reason"]
    assert health["counters"]["tracks_without_frame"] > 0
    assert stage.log.read_text().count("which is no frame of") == 1, "said once, not for each message"
    assert not stage.answered

    def well():
        stage.give()
        return stage.health["state"] == "ok" and stage.seq - 1 in stage.answered

    stage.wait_until(well, "answers, and health as before")


@pytest.mark.parametrize("stage", ["ellipsoid", "affine"], indirect=True)
@pytest.mark.parametrize("face_px", [0.3, 8192.0])
def test_a_face_as_wide_as_no_face_is_answered_and_ends_no_stage(stage, face_px):
    def answered():
        stage.give(face_px=face_px)
        return len(stage.answered) > 8

    stage.wait_until(answered, "answers to faces that are none")
    assert stage.health["rss_mb"] < 600
