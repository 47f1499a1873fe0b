import pytest
from deixis_headpose import service
from deixis_headpose.config import HeadposeConfig
from deixis_runtime.lens import Lens
from deixis_schemas.messages import CameraInfo, Frame, Tracks
from stub_node import StubNode


def frame(seq: int) -> Frame:
    return Frame(
        run=1, seq=seq, stamp_ns=seq, stage="camera", instance="c", width=2, height=2, encoding="mono8", data=b"abcd"
    )  # fmt: skip


def tracks(seq: int) -> Tracks:
    return Tracks(run=1, seq=seq, stamp_ns=seq, stage="tracker", instance="t", width=2, height=2)


INFO = CameraInfo(
    stamp_ns=1, stage="camera", instance="c", state="streaming", source="/dev/video0", width=2, height=2,
    camera_matrix=(7.0, 0, 0.5, 0, 7.0, 0.5, 0, 0, 1),
)  # fmt: skip


@pytest.fixture
def lenses(monkeypatch: pytest.MonkeyPatch) -> list[Lens]:
    """The lens that each frame was estimated with."""
    used: list[Lens] = []

    def update(_estimator: object, _image: object, _tracks: object, lens: Lens, _run: int, _stamp_ns: int) -> list:
        used.append(lens)
        return []

    monkeypatch.setattr(service.HeadPoseEstimator, "update", update)
    return used


def test_until_the_camera_tells_its_lens_one_of_60_degrees_is_assumed_and_health_says_so(lenses: list[Lens]) -> None:
    node = StubNode("headpose", [[frame(0), tracks(0)], [INFO, frame(1), tracks(1)]])
    service.serve(node, HeadposeConfig())
    assert [message.seq for message in node.published] == [0, 1]
    assert lenses == [Lens.assumed(2, 2, 60.0), Lens.of(INFO)]
    assert [list(notes) for notes in node.notes] == [["lens"], []]
