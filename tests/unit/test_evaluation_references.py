"""References are stored and read back, and a stage that answers otherwise is found out."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from deixis_evaluation.clips import Clip, load_clips
from deixis_evaluation.references import ReferencesError, read_reference, renew, write_reference
from deixis_evaluation.replay import REPLAYS, Given
from deixis_schemas.messages import Gestures, Message, Producer, Tracks

OUTLINE = b"\x01\x00\x02\x00\x03\x00\x04\x00\x05\x00\x06\x00"


@pytest.fixture
def clip(clips: Path) -> Clip:
    return load_clips(clips, "small")[0]


def tracks() -> list[Message]:
    hand = {"track_id": 3, "person_id": 0, "kind": "left_hand", "kind_probabilities": {}, "centroid_px": (120.25, 110)}
    hand |= {"bbox_px": (100, 80, 40, 60), "velocity_px_s": (0, 0), "contour": OUTLINE}
    head = {"run": 1, "stamp_ns": 10**18 + 1, "stage": "tracker", "instance": "t", "width": 640, "height": 480}
    return [Tracks.model_validate({**head, "seq": seq, "tracks": [hand]}) for seq in range(5)]


def always(gesture: str) -> Callable[[Given], Sequence[Message]]:
    def replay(given: Given) -> Sequence[Message]:
        said = {"person_id": 0, "phase": "stroke", "gesture": gesture}
        return [Gestures.derive(seen, Producer("gesture", "t"), gestures=[said]) for seen in given.of(Tracks)]

    return replay


def test_messages_come_back_as_they_were_with_their_outlines(tmp_path: Path) -> None:
    write_reference(tmp_path, "a", "tracker", tracks())
    assert read_reference(tmp_path, "a", "tracker") == tracks()


def test_equal_messages_give_equal_bytes(tmp_path: Path) -> None:
    write_reference(tmp_path, "a", "tracker", tracks())
    write_reference(tmp_path, "b", "tracker", read_reference(tmp_path, "a", "tracker"))
    assert (tmp_path / "a.tracker.xz").read_bytes() == (tmp_path / "b.tracker.xz").read_bytes()


def test_a_reference_that_is_missing_or_damaged_is_named(tmp_path: Path) -> None:
    with pytest.raises(ReferencesError, match=r"a\.tracker\.xz': No such file"):
        read_reference(tmp_path, "a", "tracker")
    (tmp_path / "a.tracker.xz").write_bytes(b"nonsense")
    with pytest.raises(ReferencesError, match=r"a\.tracker\.xz' cannot be read"):
        read_reference(tmp_path, "a", "tracker")


def test_a_renewal_says_what_is_new_what_is_the_same_and_what_has_changed(
    tmp_path: Path, clip: Clip, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_reference(tmp_path, clip.name, "tracker", tracks())
    write_reference(tmp_path, clip.name, "headpose", [])
    monkeypatch.setitem(REPLAYS, "gesture", always("point_left"))
    assert renew(clip, "gesture", tmp_path).startswith("new")
    assert renew(clip, "gesture", tmp_path) == "the same"
    monkeypatch.setitem(REPLAYS, "gesture", always("point_right"))
    assert "gesture differs in 5 of 5 frames" in renew(clip, "gesture", tmp_path)
    assert renew(clip, "gesture", tmp_path) == "the same"
