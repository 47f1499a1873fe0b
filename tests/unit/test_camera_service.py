"""The loop's side of the camera: which pictures go out when, and with which stamps."""

import contextlib
import logging
from collections.abc import Iterator

import pytest
from deixis_camera.calibration import AssumedFieldOfView
from deixis_camera.config import CameraConfig
from deixis_camera.handoff import Became, Opened, Ready
from deixis_camera.ladder import Rung
from deixis_camera.link_control import LinkControl
from deixis_camera.pictures import Encoded
from deixis_camera.service import CameraStage, first_run
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, Frame, Gestures, Message, Producer
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


class FakeReaders:
    """Who reads frames elsewhere, as set by hand."""

    def __init__(self) -> None:
        self.hosts: set[str] = set()
        self.new: set[tuple[str, str]] = set()

    def turn(self) -> None:
        pass

    def elsewhere(self) -> set[str]:
        return self.hosts

    def unsettled(self) -> set[tuple[str, str]]:
        return self.new


class FakeInput:
    """Messages that were heard, put there by hand."""

    def __init__(self) -> None:
        self.heard: list[Message] = []

    def take_all(self) -> list[Message]:
        heard, self.heard = self.heard, []
        return heard


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
        self.inputs: dict[str, FakeInput] = {}
        self.readers = FakeReaders()
        self.notes: dict[str, str | None] = {}

    def publish(self, topic: Topic) -> FakePublisher:
        return self.outputs.setdefault(topic.path, FakePublisher())

    def subscribe(self, topic: Topic, _depth: int = 1) -> FakeInput:
        return self.inputs.setdefault(topic.path, FakeInput())

    def follow_readers(self, _topic: Topic) -> FakeReaders:
        return self.readers

    def note(self, key: str, text: str | None) -> None:
        self.notes[key] = text

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

    warn = set_state = serve_get

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


def answer(node: FakeNode, frame: Frame) -> None:
    """The gesture stage answers the frame."""
    node.inputs[topics.GESTURES.path].heard.append(Gestures.derive(frame, Producer("gesture", "g")))


def play_live(node: FakeNode, stage: CameraStage, seconds: float, first_seq: int = 0, *, answered: bool) -> None:
    """A live source of 20 Hz, whose frames are answered after 50 ms or not at all."""
    for seq in range(first_seq, first_seq + round(20 * seconds)):
        waiting = node.frames[-1] if node.frames else None
        if answered and waiting is not None:
            answer(node, waiting)
        stage.handoff.put_live(ready(7, seq, node.monotonic_ns))
        stage.step()
        node.pass_ms(50)


def test_on_one_host_nothing_is_adapted_and_nobody_is_listened_to() -> None:
    node = FakeNode()
    stage = stage_on(node)
    stage.handoff.report(Opened(True, 20.0))
    play_live(node, stage, 5.0, answered=False)
    assert len(node.frames) == 100
    assert node.inputs == {}
    assert node.notes.get("link") is None


def test_frames_that_another_host_does_not_answer_are_held_back_and_that_is_counted_and_said() -> None:
    node = FakeNode()
    node.readers.hosts = {"edge"}
    stage = stage_on(node)
    stage.handoff.report(Opened(True, 20.0))
    play_live(node, stage, 5.0, answered=False)
    assert 10 <= len(node.frames) <= 25
    assert node.counters["pictures_held_back"] == 100 - len(node.frames)
    said = node.notes["link"]
    assert said is not None
    assert said.startswith("sends JPEGs of quality 50 at up to 5/s to edge: no answer")


def test_frames_that_another_host_answers_in_time_all_go_out() -> None:
    node = FakeNode()
    node.readers.hosts = {"edge"}
    stage = stage_on(node)
    stage.handoff.report(Opened(True, 20.0))
    play_live(node, stage, 5.0, answered=True)
    assert len(node.frames) == 100
    assert node.notes["link"] == (
        "sends JPEGs of quality 85 at up to 20/s to edge: 82 kB/s arrive, answered after 50 ms (at the quickest 50 ms)"
    )


def test_what_adapts_not_by_its_settings_sends_all() -> None:
    node = FakeNode()
    node.readers.hosts = {"edge"}
    stage = stage_on(node, adapt=False, quality=70)
    stage.handoff.report(Opened(True, 20.0))
    play_live(node, stage, 5.0, answered=False)
    assert len(node.frames) == 100
    assert (
        node.notes["link"] == "sends JPEGs of quality 70 at the source's rate to edge: not adapted to the link (camera.adapt)"
    )


@pytest.mark.parametrize(
    ("encoding", "hosts", "quality"),
    [("auto", set(), None), ("auto", {"edge"}, 50), ("bgr8", {"edge"}, None), ("jpeg", set(), 85), ("jpeg", {"edge"}, 50)],
)
def test_pictures_are_raw_on_one_host_and_jpegs_between_two(encoding: str, hosts: set[str], quality: int | None) -> None:
    node = FakeNode()
    node.readers.hosts = hosts
    link = LinkControl(node, CameraConfig.model_validate({"encoding": encoding}))  # type: ignore[arg-type]
    link.turn(node.monotonic_s())
    assert link.rung.quality == quality, "the lowest rung to begin with, where it adapts"


def test_lockstep_never_adapts() -> None:
    node = FakeNode(lockstep=True)
    node.readers.hosts = {"edge"}
    link = LinkControl(node, CameraConfig.model_validate({}))  # type: ignore[arg-type]
    link.turn(node.monotonic_s())
    assert link.settled()
    assert link.rung == Rung(None, 0.0)
