"""The benchmark that lays real people beside rendered ones: on data made up here."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

BENCH = Path(__file__).parents[2] / "bench"
SKIN = (110, 140, 200)


@pytest.fixture(autouse=True)
def bench(monkeypatch: pytest.MonkeyPatch) -> None:
    """The benchmarks' folder, as for `python bench/real_people.py`."""
    monkeypatch.syspath_prepend(str(BENCH))


def hand(fingers: int) -> np.ndarray:
    """A palm on a forearm with so many fingers up: (240, 200), 0 and 1."""
    mask = np.zeros((240, 200), np.uint8)
    cv2.circle(mask, (100, 130), 40, 1, -1)
    cv2.rectangle(mask, (75, 130), (125, 235), 1, -1)
    for number in range(fingers):
        x = 100 + 34 * number - 17 * (fingers - 1)
        cv2.rectangle(mask, (x - 8, 30), (x + 8, 130), 1, -1)
    return mask


@pytest.mark.parametrize("fingers", [0, 1, 2])
def test_fingers_of_a_drawn_hand_are_counted_at_any_size(fingers: int) -> None:
    from real_hands import fingers_of, lone_hand

    mask = hand(fingers)
    assert fingers_of(lone_hand(mask)) == fingers
    assert fingers_of(lone_hand(cv2.resize(mask, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_NEAREST))) == fingers
    assert fingers_of(lone_hand(np.zeros_like(mask))) == 0


def test_items_are_sampled_evenly() -> None:
    from real_hands import sampled

    assert sampled(range(28), 4) == [0, 7, 14, 21]
    assert sampled([1, 2], 5) == [1, 2]
    assert sampled([], 5) == []


def test_a_little_finger_alone_counts_as_another_hand_that_was_taken_for_an_index(tmp_path: Path) -> None:
    from real_hands import hgr1

    hands(tmp_path, "Z")
    hands(tmp_path, "I")
    assert hgr1(tmp_path, 10).figures()["one_finger_precision"] == 0.5


def test_a_boxed_hand_is_cut_out_whatever_the_colour_of_the_wall() -> None:
    from real_hands import RAISED, cut_out, fingers_of, hand_on

    mask = hand(1)
    for wall in ((90, 90, 90), (90, 140, 200)):  # the second is of the colour of skin to the prior
        picture = np.full((*mask.shape, 3), wall, np.uint8)
        picture[mask > 0] = SKIN
        picture = np.clip(picture + np.random.default_rng(1).normal(0, 4, picture.shape), 0, 255).astype(np.uint8)
        rows, columns = np.nonzero(mask)
        box = int(columns.min()) - 4, int(rows.min()) - 4, int(columns.max()) + 4, int(rows.max()) + 4
        assert fingers_of(hand_on(cut_out(picture, box), RAISED)) == 1
    assert not cut_out(np.zeros((20, 20, 3), np.uint8), (0, 0, 20, 20)).any()


def hands(folder: Path, sign: str = "Z") -> None:
    """One picture of hgr1, of a sign; with the index finger alone by default."""
    folder.mkdir(parents=True, exist_ok=True)
    mask = hand(1)
    picture = np.full((*mask.shape, 3), 90, np.uint8)
    picture[mask > 0] = SKIN
    cv2.imwrite(str(folder / f"{sign}_P_hgr1_id01_1.jpg"), picture)
    cv2.imwrite(str(folder / f"{sign}_P_hgr1_id01_1.mask.png"), 255 * mask)


def test_what_is_not_there_is_left_out_and_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from real_people import main

    hands(tmp_path / "hgr1")
    assert main(["--data", str(tmp_path), "--json", str(tmp_path / "figures.json")]) == 0
    content = json.loads((tmp_path / "figures.json").read_text())
    assert content["figures"]["hands_hgr1_one_finger_seen_share"] == 1
    assert content["figures"]["hands_hgr1_skin_found_share"] > 0.9
    assert content["machine"]["cores"] >= 1
    told = capsys.readouterr()
    assert "signers: left out" in told.err
    assert "one finger seen share" in told.out


def test_nothing_to_measure_and_bad_data_are_errors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from real_people import main

    assert main(["--data", str(tmp_path)]) == 1
    assert "nothing to measure" in capsys.readouterr().err
    hands(tmp_path / "hgr1")
    (tmp_path / "hgr1" / "Z_P_hgr1_id01_1.jpg").unlink()
    assert main(["--data", str(tmp_path)]) == 1
    assert "do not belong together" in capsys.readouterr().err
    assert main(["--data", str(tmp_path), "--simulated", str(tmp_path / "none")]) == 1


def test_an_empty_room_has_no_faces_and_no_episodes() -> None:
    from deixis_evaluation.chain import Chain, camera_of

    chain = Chain(camera_of(320, 240, 280.0))
    random = np.random.default_rng(1)
    said = [chain.see(random.integers(90, 110, (240, 320, 3), dtype=np.uint8), number / 30) for number in range(4)]
    assert [answer.tracks.seq for answer in said] == [0, 1, 2, 3]
    assert all(answer.tracks.tracks == [] and answer.targets == () for answer in said)
    assert chain.end() == ()
