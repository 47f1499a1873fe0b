import pytest
from deixis_gesture import service
from deixis_gesture.config import GestureConfig
from deixis_runtime.lens import Lens
from deixis_schemas.messages import CameraInfo, Tracks
from stub_node import StubNode

INFO = CameraInfo(
    stamp_ns=1, stage="camera", instance="c", state="streaming", source="/dev/video0", width=640, height=480,
    camera_matrix=(400.0, 0, 319.5, 0, 400.0, 239.5, 0, 0, 1),
)  # fmt: skip


def tracks(seq):
    return Tracks(run=1, seq=seq, stamp_ns=seq, stage="tracker", instance="t", width=640, height=480)


@pytest.fixture
def lenses(monkeypatch):
    """The lens that each frame was seen through."""
    used = []

    def update(_recognizer, _tracks, _width, _height, lens, _run, _stamp_ns, _room_offset_px, _mount):
        used.append(lens)
        return []

    monkeypatch.setattr(service.GestureRecognizer, "update", update)
    return used


def test_until_the_camera_tells_its_lens_one_of_60_degrees_is_assumed_and_health_says_so(lenses):
    node = StubNode("gesture", [[tracks(0)], [INFO, tracks(1)]])
    service.serve(node, GestureConfig())
    assert [message.seq for message in node.published] == [0, 1]
    assert lenses == [Lens.assumed(640, 480, 60.0), Lens.of(INFO)]
    assert [list(notes) for notes in node.notes] == [["lens"], []]


def test_a_lens_that_cannot_be_is_warned_of_by_its_key_and_counted_and_an_assumed_one_is_used(lenses):
    impossible = INFO.model_copy(update={"camera_matrix": (1.0, 0, 319.5, 0, 1.0, 239.5, 0, 0, 1)})
    node = StubNode("gesture", [[impossible, tracks(0)]])
    service.serve(node, GestureConfig())
    assert lenses == [Lens.assumed(640, 480, 60.0)]
    assert node.counters == {"lenses_refused": 1}
    assert node.warnings == [
        "deixis/r1/camera/info: not used: camera/c: camera_matrix: "
        "a focal length of 1 pixels is a view 179.64 degrees wide; 5 to 170 can be"
    ]
    assert "camera_matrix" in node.notes[0]["lens"]


@pytest.mark.usefixtures("lenses")
def test_health_says_that_tracks_are_of_another_aspect_ratio_than_the_lens():
    wide = tracks(0).model_copy(update={"height": 360})
    node = StubNode("gesture", [[INFO, wide], [], [tracks(1)]])
    service.serve(node, GestureConfig())
    assert ["another aspect ratio" in notes.get("lens", "") for notes in node.notes] == [True, True, False]
