"""The camera as a process, behind a real router: what others receive from it."""

import contextlib
import hashlib
import http.server
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import zenoh
from deixis_runtime.session import open_client
from deixis_runtime.settings import STARTED_BEFORE
from deixis_schemas import codec, topics
from deixis_schemas.messages import Belief, CameraInfo, Frame, FrameId, Health, Producer

STAGES_BUT_CAMERA = ("tracker", "headpose", "gesture", "fusion")
PATIENCE_S = 20.0


def wait_for(condition: Callable[[], bool], what: str, patience_s: float = PATIENCE_S) -> None:
    deadline = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < deadline, f"{what} did not come within {patience_s:g} s"
        time.sleep(0.01)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    """Endpoint of a router on loopback."""
    name = f"tcp/127.0.0.1:{free_port()}"
    router = subprocess.Popen([sys.executable, "-m", "deixis_runtime.router", "--listen", name], stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + PATIENCE_S
    while True:
        with contextlib.suppress(ConnectionError), open_client(name, shared_memory=False):
            break
        assert time.monotonic() < deadline
        assert router.poll() is None
    yield name
    router.terminate()
    router.wait(10)


class Watcher:
    """Receives what a camera publishes; in lockstep it answers as fusion does."""

    def __init__(self, session: zenoh.Session, robot: str, *, answers: bool = False, stages: tuple[str, ...] = ()) -> None:
        self.session = session
        self.robot = robot
        self.frames: list[Frame] = []
        self.infos: list[CameraInfo] = []
        self.healths: list[Health] = []
        self.unanswered = 0
        self.most_unanswered = 0
        self._answers = answers
        self._declared: list[object] = [
            session.declare_subscriber(topics.FRAME.key(robot), self._frame),
            session.declare_subscriber(topics.CAMERA_INFO.key(robot), self._info),
            session.declare_subscriber(topics.HEALTH.key(robot, stage="camera"), self._health),
            *(session.liveliness().declare_token(topics.alive_key(robot, stage, "test")) for stage in stages),
        ]

    def answer(self, frame: Frame) -> None:
        """Publish fusion's belief of a frame."""
        belief = Belief.derive(frame, Producer("fusion", "test"))
        self.unanswered -= 1  # before it goes out: the next frame may be here before `put` returns
        with contextlib.suppress(zenoh.ZError):  # the test is over and the session closed
            self.session.put(topics.BELIEF.key(self.robot), codec.encode(belief), encoding=codec.encoding_of(Belief))

    def state(self) -> str:
        return self.infos[-1].state if self.infos else ""

    def said_end(self) -> bool:
        """The camera said that it ended. Outside lockstep its last frame may have been dropped on a busy machine."""
        return self.state() == "ended"

    def at_end(self) -> bool:
        """The camera said that it ended, and its last frame is here: the word, more urgent, may overtake it."""
        return self.state() == "ended" and bool(self.frames) and self.frames[-1].frame_id == self.said_last()

    def said_last(self) -> FrameId:
        """The frame that CameraInfo names as the last."""
        return FrameId(self.infos[-1].run, self.infos[-1].last_seq)

    def get(self, key: str) -> list[dict[str, Any]]:
        """Replies to a get, as JSON."""
        replies = self.session.get(f"{key}?format=json", timeout=5.0)
        return [json.loads(reply.ok.payload.to_bytes()) for reply in replies if reply.ok is not None]

    def frame_ids(self) -> list[FrameId]:
        return [frame.frame_id for frame in self.frames]

    def digest(self) -> list[tuple[int, int, int, str]]:
        return [(frame.run, frame.seq, frame.stamp_ns, hashlib.sha256(frame.data).hexdigest()) for frame in self.frames]

    def _frame(self, sample: zenoh.Sample) -> None:
        frame = codec.decode(Frame, sample.payload.to_bytes(), str(sample.encoding), max_bytes=topics.FRAME.max_bytes)
        self.unanswered += 1
        self.most_unanswered = max(self.most_unanswered, self.unanswered)
        self.frames.append(frame)
        if self._answers:
            timer = threading.Timer(0.01, self.answer, [frame])
            timer.daemon = True
            timer.start()

    def _info(self, sample: zenoh.Sample) -> None:
        self.infos.append(codec.decode(CameraInfo, sample.payload.to_bytes(), str(sample.encoding)))

    def _health(self, sample: zenoh.Sample) -> None:
        self.healths.append(codec.decode(Health, sample.payload.to_bytes(), str(sample.encoding)))


class Camera:
    """A camera process; `said` is its standard error."""

    def __init__(self, endpoint: str, robot: str, log: Path, *arguments: str, environment: dict[str, str]) -> None:
        script = Path(sys.executable).parent / "deixis-camera"
        command = [str(script), "--robot", robot, "--connect", endpoint, *arguments]
        self._log = log
        with log.open("wb") as file:
            self.process = subprocess.Popen(command, stderr=file, env={**os.environ, "DEIXIS_LOG": "INFO", **environment})

    @property
    def said(self) -> str:
        return self._log.read_text()

    def stop(self) -> float:
        """Ask it to stop; the seconds that took."""
        began = time.monotonic()
        self.process.terminate()
        self.process.wait(10)
        return time.monotonic() - began


@contextlib.contextmanager
def camera_and_watcher(
    endpoint: str,
    folder: Path,
    *arguments: str,
    answers: bool = False,
    stages: tuple[str, ...] = (),
    environment: dict[str, str] | None = None,
) -> Iterator[tuple[Camera, Watcher]]:
    robot = f"r{len(list(folder.glob('*.log')))}-{folder.name}"[:60]
    with open_client(endpoint, shared_memory=False) as session:
        watcher = Watcher(session, robot, answers=answers, stages=stages)
        camera = Camera(endpoint, robot, folder / f"{robot}.log", *arguments, environment=environment or {})
        try:
            yield camera, watcher
        finally:
            if camera.process.poll() is None:
                camera.stop()


def write_film(path: Path, frames: int = 20, rate_hz: float = 25.0) -> Path:
    code, backend = ("MJPG", cv2.CAP_OPENCV_MJPEG) if path.suffix == ".avi" else ("mp4v", cv2.CAP_FFMPEG)
    writer = cv2.VideoWriter(str(path), backend, cv2.VideoWriter.fourcc(*code), rate_hz, (160, 120))
    for index in range(frames):
        picture = np.full((120, 160, 3), 60, np.uint8)
        picture[:, 5 * (index % 30) :][:, :10] = 220
        writer.write(picture)
    writer.release()
    return path


def test_a_film_is_published_whole_at_its_own_rate_and_its_end_is_said(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.mp4")
    with camera_and_watcher(endpoint, tmp_path, "--set", f"source={film}") as (camera, watcher):
        wait_for(watcher.said_end, "the end")
        seqs, stamps = (np.array([getattr(frame, name) for frame in watcher.frames]) for name in ("seq", "stamp_ns"))
        health = watcher.get(topics.HEALTH.key(watcher.robot, stage="camera"))[0]
        published = next(item["published"] for item in health["outputs"] if item["key"].endswith(topics.FRAME.path))
        skipped = health["counters"].get("pictures_skipped", 0)
        assert published + skipped == 20, "a busy machine may skip some, and counts them"
        assert len(seqs) > 10, "and Zenoh may drop some on the way"
        assert (seqs[0], np.diff(seqs).min() > 0) == (0, True)
        assert (np.diff(stamps) / np.diff(seqs)).min() > 38e6
        assert np.median(np.diff(stamps) / np.diff(seqs)) == pytest.approx(40e6, abs=2e6)
        assert abs(time.time_ns() - stamps[-1]) < 10e9
        info = watcher.infos[-1]
        assert (info.last_seq, info.width, info.height, info.rate_hz, info.lockstep) == (19, 160, 120, 25.0, False)
        assert info.camera_matrix is not None
        assert info.camera_matrix[0] == pytest.approx(80 / np.tan(np.radians(30)))
        assert "assumed from a horizontal field of view of 60 degrees" in info.intrinsics
        first = watcher.infos.index(next(item for item in watcher.infos if item.width))
        assert watcher.infos[first].last_seq == -1, "the intrinsics are there before the first frame"
        assert watcher.get(topics.CAMERA_INFO.key(watcher.robot))[0]["state"] == "ended"
        assert any("assumed" in note for note in watcher.get(topics.HEALTH.key(watcher.robot, stage="camera"))[0]["notes"])
        assert camera.stop() < 4
        assert camera.process.returncode == 0


def test_lockstep_gives_equal_frames_in_two_runs_and_never_two_unanswered(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.mp4", frames=70)
    runs, infos = [], []
    for _ in range(2):
        arguments = ("--lockstep", "--set", f"source={film}")
        with camera_and_watcher(endpoint, tmp_path, *arguments, answers=True, stages=STAGES_BUT_CAMERA) as (_, watcher):
            wait_for(watcher.at_end, "the end")
            runs.append(watcher.digest())
            infos.append([info.model_copy(update={"instance": ""}) for info in watcher.infos])
            assert watcher.most_unanswered == 1
            assert watcher.infos[-1].lockstep
            assert watcher.healths[-1].counters.get("lockstep_unanswered", 0) == 0
    assert [(run, seq) for run, seq, _, _ in runs[0]] == [(0, index) for index in range(70)]
    assert np.diff([stamp for _, _, stamp, _ in runs[0]]) == pytest.approx(40e6)
    assert runs[0] == runs[1]
    assert infos[0] == infos[1]
    assert [info.state for info in infos[0]] == ["streaming", "streaming", "ended"], "again after each 60 frames"
    assert infos[0][-1].stamp_ns == runs[0][-1][2]


def test_each_pass_of_a_loop_is_a_run_and_a_restart_begins_others(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.mp4", frames=3)
    arguments = ("--lockstep", "--set", f"source={film}", "--set", "loop=true")
    named = []
    for before in ("0", "2"):
        environment = {STARTED_BEFORE: before}
        with camera_and_watcher(
            endpoint, tmp_path, *arguments, answers=True, stages=STAGES_BUT_CAMERA, environment=environment
        ) as (_, watcher):
            wait_for(lambda watcher=watcher: len(watcher.frames) >= 7, "three passes")
            named.append(watcher.frame_ids()[:7])
            stamps = [frame.stamp_ns for frame in watcher.frames]
            assert np.diff(stamps) == pytest.approx(40e6), "time goes on"
    passes = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0)]
    assert named[0] == passes
    assert named[1] == [((2 << 32) + run, seq) for run, seq in passes]


def test_a_live_run_is_named_for_the_time_of_the_start(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.mp4", frames=3)
    runs = []
    for _ in range(2):
        began_ms = time.time_ns() // 1_000_000
        with camera_and_watcher(endpoint, tmp_path, "--set", f"source={film}") as (_, watcher):
            wait_for(lambda: watcher.said_end() and watcher.frames, "the end")
            assert began_ms < watcher.frames[0].run < time.time_ns() // 1_000_000
            assert {frame.run for frame in watcher.frames} == {watcher.frames[0].run}
            runs.append(watcher.frames[0].run)
    assert runs[0] < runs[1]


def test_lockstep_goes_on_without_answers_and_counts_them(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.mp4", frames=5)
    arguments = ("--lockstep", "--set", f"source={film}", "--set", "lockstep_timeout_s=0.2")
    with camera_and_watcher(endpoint, tmp_path, *arguments, stages=STAGES_BUT_CAMERA) as (camera, watcher):
        wait_for(watcher.at_end, "the end")
        wait_for(lambda: watcher.healths[-1].counters.get("lockstep_unanswered", 0) >= 4, "the count")
        assert [frame.seq for frame in watcher.frames] == [0, 1, 2, 3, 4], "each once, also unanswered"
        assert camera.said.count("/fusion/belief: no answer to frame") == 1, "said once in ten seconds"


def test_lockstep_waits_for_the_stages_that_answer(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.mp4", frames=3)
    with camera_and_watcher(endpoint, tmp_path, "--lockstep", "--set", f"source={film}", answers=True) as (_, watcher):
        wait_for(lambda: len(watcher.healths) >= 3, "heartbeats")
        assert watcher.frames == []
        tokens = [
            watcher.session.liveliness().declare_token(topics.alive_key(watcher.robot, stage, "test"))
            for stage in STAGES_BUT_CAMERA
        ]
        wait_for(watcher.at_end, "the end")
        assert [frame.seq for frame in watcher.frames] == [0, 1, 2]
        assert len(tokens) == 4


def test_a_camera_that_is_not_there_is_retried_and_the_stage_lives_on(endpoint: str, tmp_path: Path) -> None:
    arguments = ("--set", "source=873", "--set", "retry_first_s=0.1", "--set", "retry_longest_s=0.2")
    with camera_and_watcher(endpoint, tmp_path, *arguments) as (camera, watcher):
        wait_for(lambda: len(watcher.healths) >= 3 and watcher.healths[-1].state == "degraded", "heartbeats")
        assert watcher.state() == "retrying"
        assert "'/dev/video873' is not there" in watcher.infos[-1].reason
        assert watcher.healths[-1].count > watcher.healths[-2].count
        assert watcher.get(topics.CAMERA_INFO.key(watcher.robot))[0]["state"] == "retrying"
        assert camera.said.count("/dev/video873") == 1, "one line, not one per retry"
        assert camera.stop() < 4


def test_a_missing_file_is_a_final_failure_that_can_be_asked_for(endpoint: str, tmp_path: Path) -> None:
    with camera_and_watcher(endpoint, tmp_path, "--set", f"source={tmp_path}/none.mp4") as (_, watcher):
        wait_for(lambda: bool(watcher.healths) and watcher.healths[-1].state == "failed", "the failure")
        answer = watcher.get(topics.CAMERA_INFO.key(watcher.robot))[0]
        assert (answer["state"], answer["reason"]) == ("failed", f"file '{tmp_path}/none.mp4' does not exist")


def test_a_film_that_is_cut_off_plays_to_the_cut_and_health_says_so(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.avi", frames=30)
    film.write_bytes(film.read_bytes()[: film.stat().st_size // 2])
    with camera_and_watcher(endpoint, tmp_path, "--set", f"source={film}") as (_, watcher):
        wait_for(watcher.said_end, "the end")
        wait_for(lambda: bool(watcher.healths), "a heartbeat")
        assert len(watcher.frames) >= 5
        assert f"{watcher.infos[-1].last_seq + 1} of about 30 frames could be read" in watcher.infos[-1].reason
        wait_for(lambda: watcher.healths[-1].state == "degraded", "the state")


def test_a_bad_calibration_is_named_and_no_frame_goes_out(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.mp4", frames=3)
    site = tmp_path / "site.yaml"
    site.write_text(f"camera: {{source: {film}, calibration: cam.yaml}}\n")
    (tmp_path / "cam.yaml").write_text("image_width: 640\n")
    with camera_and_watcher(endpoint, tmp_path, "--site", str(site)) as (_, watcher):
        wait_for(lambda: watcher.state() == "failed", "the failure")
        assert f"calibration '{tmp_path}/cam.yaml': image_height" in watcher.infos[-1].reason
        assert watcher.frames == []


def test_the_site_file_gives_calibration_and_mount(endpoint: str, tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.mp4", frames=3)
    (tmp_path / "cam.yaml").write_text(
        "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n"
        "camera_matrix: {rows: 3, cols: 3, data: [600, 0, 319.5, 0, 600, 239.5, 0, 0, 1]}\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0, 0, 0, 0]}\n"
    )
    site = tmp_path / "site.yaml"
    site.write_text(
        f"camera:\n  source: {film}\n  calibration: cam.yaml\n"
        "  mount: {position_m: [0.1, 0, 1.4], pitch_up_deg: 5, roll_deg: 1}\n"
    )
    with camera_and_watcher(endpoint, tmp_path, "--site", str(site)) as (_, watcher):
        wait_for(watcher.said_end, "the end")
        info = watcher.infos[-1]
        assert info.camera_matrix == pytest.approx((150, 0, 79.5, 0, 150, 59.5, 0, 0, 1))
        assert (info.distortion_model, info.distortion) == ("plumb_bob", [0.1, 0, 0, 0, 0])
        assert (info.mount.position_m, info.mount.pitch_up_deg, info.mount.roll_deg) == ((0.1, 0.0, 1.4), 5.0, 1.0)


def test_a_misspelt_field_of_the_mount_stops_the_stage_and_is_named(endpoint: str, tmp_path: Path) -> None:
    with camera_and_watcher(endpoint, tmp_path, "--set", "mount.pitch_deg=5") as (camera, _):
        assert camera.process.wait(PATIENCE_S) == 78
        assert "settings of camera: mount.pitch_deg: " in camera.said


@contextlib.contextmanager
def web_server(folder: Path, port: int = 0) -> Iterator[int]:
    """Files of a folder by HTTP on loopback; gives the port."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments, directory=str(folder))

        def log_message(self, *_: object) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield int(server.server_address[1])
        server.shutdown()


def test_a_web_film_that_is_lost_and_comes_back_starts_at_0_in_a_new_run(endpoint: str, tmp_path: Path) -> None:
    write_film(tmp_path / "film.mp4", frames=15)
    with contextlib.ExitStack() as first_life:
        port = first_life.enter_context(web_server(tmp_path))
        arguments = ("--set", f"source=http://127.0.0.1:{port}/film.mp4", "--set", "loop=true", "--set", "retry_longest_s=0.5")
        with camera_and_watcher(endpoint, tmp_path, *arguments) as (_, watcher):
            wait_for(lambda: len(watcher.frames) > 2, "frames")
            first_life.close()
            wait_for(lambda: watcher.state() == "retrying", "the loss")
            lost = watcher.infos[-1].run
            with web_server(tmp_path, port):
                wait_for(lambda: watcher.frames[-1].run > lost, "frames anew")
            again = next(frame for frame in watcher.frames if frame.run > lost)
            assert (again.run, again.seq) == (lost + 1, 0)


@pytest.fixture
def hanging_camera() -> Iterator[str]:
    """URL of an IP camera that sends a second of pictures and then nothing, with the line open."""
    over = threading.Event()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
            self.end_headers()
            data = cv2.imencode(".jpg", np.full((120, 160, 3), 90, np.uint8))[1].tobytes()
            with contextlib.suppress(OSError):
                for _ in range(30):
                    head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
                    self.wfile.write(head.encode() + data + b"\r\n")
                    over.wait(0.03)
            over.wait(30)

        def log_message(self, *_: object) -> None:
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://admin:s3cret@127.0.0.1:{server.server_address[1]}/video?key=s3cret"
    over.set()
    server.shutdown()
    server.server_close()


def test_a_stream_that_hangs_stops_neither_heartbeats_nor_shutdown_and_shows_no_password(
    endpoint: str, tmp_path: Path, hanging_camera: str
) -> None:
    arguments = ("--set", f"source={hanging_camera}", "--set", "read_timeout_s=30", "--set", "stalled_after_s=0.5")
    with camera_and_watcher(endpoint, tmp_path, *arguments) as (camera, watcher):
        wait_for(lambda: len(watcher.frames) > 5, "frames")
        stamps = [frame.stamp_ns for frame in watcher.frames]
        assert stamps == sorted(stamps)
        assert 0 < time.time_ns() - stamps[-1] < 5e9, "stamps are Unix time"
        wait_for(lambda: watcher.state() == "retrying", "the stall")
        assert "is open but gives no new pictures" in watcher.infos[-1].reason
        beats = len(watcher.healths)
        wait_for(lambda: len(watcher.healths) >= beats + 2, "heartbeats", 4)
        assert watcher.healths[-1].state == "degraded"
        assert camera.stop() < 4
        assert camera.process.returncode == 0
        assert "s3cret" not in camera.said + str(watcher.infos) + str(watcher.healths)
        assert "admin" not in camera.said
