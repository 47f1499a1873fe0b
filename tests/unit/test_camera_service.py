"""The loop's side of the camera: which pictures go out when, and with which stamps."""

import contextlib
import logging
from collections.abc import Iterator

import pytest
from deixis_camera.calibration import AssumedFieldOfView
from deixis_camera.config import CameraConfig
from deixis_camera.handoff import Became, Opened, Ready
from deixis_camera.pictures import Encoded
from deixis_camera.service import CameraStage, first_run
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, Frame, Message, Producer
from deixis_schemas.topics import Topic

MS = 1_000_000
NOON_NS = 1_800_000_000_000 * MS


class FakePublisher:
    def __init__(self) -> None:
        self.sent: list[Message] = []

    def matching(self) -> bool:
        return True

    def put(self, message: Message) -> None:
        self.sent.append(message)


class FakeNode:
    """Stands in for the runtime's Node; its two clocks are set by hand."""

    def __init__(self, *, lockstep: bool = False, started_before: int = 0) -> None:
        self.producer = Producer("camera", "a")
        self.robot = "r1"
        self.site = None
        self.lockstep = lockstep
        self.started_before = started_before
        self.log = logging.getLogger("test")
        self.wall_ns = NOON_NS
        self.monotonic_ns = 3_000 * MS
        self.counters: dict[str, int] = {}
        self.outputs: dict[str, FakePublisher] = {}

    def publish(self, topic: Topic) -> FakePublisher:
        return self.outputs.setdefault(topic.path, FakePublisher())

    def now_ns(self) -> int:
        return self.wall_ns

    def monotonic_s(self) -> float:
        return self.monotonic_ns / 1e9

    def count(self, name: str, n: int = 1) -> None:
        self.counters[name] = self.counters.get(name, 0) + n

    @contextlib.contextmanager
    def step(self) -> Iterator[None]:
        yield

    def serve_get(self, *_: object) -> None:
        pass

    note = warn = set_state = serve_get

    def pass_ms(self, passed_ms: int) -> None:
        """Let time pass on both clocks."""
        self.wall_ns += passed_ms * MS
        self.monotonic_ns += passed_ms * MS

    @property
    def frames(self) -> list[Frame]:
        return [sent for sent in self.outputs[topics.FRAME.path].sent if isinstance(sent, Frame)]

    @property
    def info(self) -> CameraInfo:
        last = self.outputs[topics.CAMERA_INFO.path].sent[-1]
        assert isinstance(last, CameraInfo)
        return last


def stage_on(node: FakeNode, **settings: object) -> CameraStage:
    return CameraStage(node, CameraConfig.model_validate(settings))  # type: ignore[arg-type]


def ready(run: int, seq: int, time_ns: int) -> Ready:
    return Ready(run, seq, time_ns, Encoded(64, 64, "mono8", bytes(64 * 64)), AssumedFieldOfView(60).for_size(64, 64))


def test_a_live_picture_is_stamped_with_the_unix_time_of_its_capture() -> None:
    node = FakeNode()
    stage = stage_on(node)
    stage.handoff.report(Opened(True, 30.0))
    stage.handoff.put_live(ready(7, 0, node.monotonic_ns))
    node.pass_ms(80)
    stage.step()
    assert [(frame.run, frame.seq, frame.stamp_ns) for frame in node.frames] == [(7, 0, NOON_NS)]


def test_a_wall_clock_that_is_set_does_not_make_a_picture_old() -> None:
    node = FakeNode()
    stage = stage_on(node)
    stage.handoff.report(Opened(True, 30.0))
    stage.handoff.put_live(ready(7, 0, node.monotonic_ns))
    node.pass_ms(80)
    node.wall_ns += 3_600_000 * MS
    stage.step()
    assert node.wall_ns - node.frames[0].stamp_ns == 80 * MS


def test_a_recording_keeps_its_rate_while_the_wall_clock_is_set_back() -> None:
    node = FakeNode()
    stage = stage_on(node)
    stage.handoff.report(Opened(False, 25.0))
    ages = []
    for seq in range(4):
        stage.handoff.put_recorded(ready(7, seq, seq * 40 * MS))
        stage.step()
        ages.append(node.wall_ns - node.frames[-1].stamp_ns)
        node.pass_ms(40)
        node.wall_ns -= 1000 * MS
    assert [frame.seq for frame in node.frames] == [0, 1, 2, 3]
    assert ages == [0, 0, 0, 0]
    assert node.counters == {}


def test_a_recording_that_comes_back_after_a_loss_loses_none_of_its_first_pictures() -> None:
    node = FakeNode()
    stage = stage_on(node)
    stage.handoff.report(Opened(False, 25.0))
    stage.handoff.put_recorded(ready(7, 0, 0))
    stage.step()
    stage.handoff.report(Became("retrying", "stream 'x' is not reached"))
    stage.step()
    node.pass_ms(5000)
    stage.handoff.report(Opened(False, 25.0))
    for seq in range(3):
        stage.handoff.put_recorded(ready(8, seq, (1 + seq) * 40 * MS))
    for _ in range(3):
        stage.step()
        node.pass_ms(40)
    assert [frame.frame_id for frame in node.frames] == [(7, 0), (8, 0), (8, 1), (8, 2)]
    assert node.counters == {}


def test_the_next_pass_of_a_loop_follows_after_one_period() -> None:
    node = FakeNode()
    stage = stage_on(node)
    stage.handoff.report(Opened(False, 25.0))
    stage.handoff.put_recorded(ready(7, 0, 0))
    stage.step()
    stage.handoff.report(Opened(False, 25.0))
    stage.handoff.put_recorded(ready(8, 0, 40 * MS))
    node.pass_ms(39)
    stage.step()
    assert len(node.frames) == 1
    node.pass_ms(1)
    stage.step()
    assert [frame.frame_id for frame in node.frames] == [(7, 0), (8, 0)]


def test_camera_info_names_the_last_frame_by_its_run_too() -> None:
    node = FakeNode()
    stage = stage_on(node)
    stage.handoff.report(Opened(False, 25.0))
    stage.handoff.put_recorded(ready(7, 4, 0))
    stage.step()
    stage.handoff.report(Became("ended"))
    stage.step()
    assert (node.info.state, node.info.run, node.info.last_seq) == ("ended", 7, 4)


def test_a_live_camera_that_falls_silent_is_said_to_stall_by_the_monotonic_clock() -> None:
    node = FakeNode()
    stage = stage_on(node, stalled_after_s=3)
    stage.handoff.report(Opened(True, 30.0))
    stage.handoff.put_live(ready(7, 0, node.monotonic_ns))
    stage.step()
    node.wall_ns += 3_600_000 * MS
    stage.step()
    assert node.info.state == "streaming"
    node.pass_ms(3001)
    stage.step()
    assert node.info.state == "retrying"


@pytest.mark.parametrize(("lockstep", "started_before", "run"), [(False, 2, NOON_NS // MS), (True, 0, 0), (True, 2, 2 << 32)])
def test_the_first_run_tells_one_start_from_another(lockstep: bool, started_before: int, run: int) -> None:
    assert first_run(FakeNode(lockstep=lockstep, started_before=started_before)) == run  # type: ignore[arg-type]
