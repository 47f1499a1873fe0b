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


def test_tracks_of_frames_that_do_not_come_are_counted_and_health_names_both_keys_until_there_is_a_pair(
    lenses: list[Lens],
) -> None:
    """A tracker with numbers of its own got no answer, and nothing said why."""
    swapped = [[frame(1000 + turn), tracks(turn)] for turn in range(4)]
    node = StubNode("headpose", [*swapped, [tracks(1003)]])
    service.serve(node, HeadposeConfig(frames_kept=2))
    assert [state for state, _ in node.states] == ["ok", "ok", "degraded", "degraded", "ok"]
    reason = node.states[2][1]
    assert "deixis/r1/tracker/tracks by tracker/t speaks of seq 0 of run 1" in reason
    assert "no frame of deixis/r1/camera/frame: the last is seq 1002 of run 1" in reason
    assert node.counters == {"tracks_without_frame": 4}
    assert len(lenses) == 1


def test_tracks_that_come_too_late_are_counted_apart_and_health_names_the_setting(lenses: list[Lens]) -> None:
    node = StubNode("headpose", [[frame(turn), *([tracks(turn - 3)] if turn >= 3 else [])] for turn in range(8)])
    service.serve(node, HeadposeConfig(frames_kept=2))
    assert node.states[-1][0] == "degraded"
    assert "2 (frames_kept) of deixis/r1/camera/frame" in node.states[-1][1]
    assert node.counters == {"tracks_skipped": 3}
    assert lenses == []


def test_frames_of_another_aspect_ratio_than_the_lens_is_told_for_are_said_in_health(lenses: list[Lens]) -> None:
    wide = INFO.model_copy(update={"width": 16, "height": 9})
    node = StubNode("headpose", [[INFO, frame(0), tracks(0)], [wide, frame(1), tracks(1)], [INFO, frame(2), tracks(2)]])
    service.serve(node, HeadposeConfig())
    assert ["lens" in notes for notes in node.notes] == [False, True, False]
    assert "camera/info: the lens is for 16 x 9, pictures have 2 x 2: another aspect ratio" in node.notes[1]["lens"]
    assert len(lenses) == 3, "they are read all the same"


def test_a_lens_that_cannot_be_is_counted_and_the_log_names_the_key(lenses: list[Lens]) -> None:
    thin = INFO.model_copy(update={"camera_matrix": (0.01, 0, 0.5, 0, 0.01, 0.5, 0, 0, 1)})
    node = StubNode("headpose", [[thin, frame(0), tracks(0)]])
    service.serve(node, HeadposeConfig())
    assert node.counters == {"lenses_refused": 1}
    assert "camera/info: not used: camera/c: camera_matrix" in node.warnings[0]
    assert lenses == [Lens.assumed(2, 2, 60.0)]
