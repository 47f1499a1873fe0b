"""The registry on a disk that is full or read-only: edits are refused in words, answers go on, nothing is half-written."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from deixis_schemas import topics
from fusion_bench import Bench, camera_info, fusion_bench, router, show, wait_until
from own_disk import FAILING, Disk, missing_for_failing_disk, missing_for_own_disk, own_disk

WHY_NOT = missing_for_own_disk()
pytestmark = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)
VASE, DOOR = {"position_m": [1, 2, 3]}, {"position_m": [4, 5, 6]}


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    with router() as it:
        yield it


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk]:
    with own_disk(tmp_path, "512k") as it:
        yield it


@pytest.fixture
def bench(endpoint: str, tmp_path: Path, disk: Disk) -> Iterator[Bench]:
    """Fusion with its registry on the disk, and one POI in it."""
    with fusion_bench(endpoint, tmp_path) as it:
        it.registry, it.within = disk.path / "pois.sqlite", disk.within
        it.start()
        assert stored(it, "vase", VASE)
        yield it


def stored(bench: Bench, poi_id: str, content: dict) -> bool:
    """Whether an edit is acknowledged; fails where it is neither that nor refused with the registry's path."""
    answer, text = bench.ask(f"fusion/poi/{poi_id}", content) or ("none", "")
    assert answer == "ok" or text.startswith(f"registry {bench.registry}: not written: "), (answer, text)
    return answer == "ok"


def ids(bench: Bench) -> list[str]:
    return [poi.poi_id for poi in bench.state("?top=1024").pois]


def ended_with(bench: Bench) -> tuple[int, str]:
    """Exit status and error output of a fusion that is started and not to live."""
    done = subprocess.run(bench.command(), capture_output=True, text=True, timeout=20, check=False)
    return done.returncode, done.stderr


def test_a_full_disk_refuses_edits_in_words_answers_go_on_and_room_is_all_that_it_takes_to_edit_again(
    bench: Bench, disk: Disk
) -> None:
    pid = bench.health().pid
    disk.fill()
    refused = bench.ask("fusion/poi/door", DOOR)
    assert refused == (
        "refused",
        f"registry {bench.registry}: not written: database or disk is full ({disk.path}: No space left on device)",
    )
    assert (bench.ask("fusion/poi/vase?op=delete") or "")[0] == "refused"
    assert (bench.ask("fusion/poi/*?op=put_all", {"a": DOOR, "b": DOOR}) or "")[0] == "refused"
    bench.session.put(topics.POI.key(bench.robot, id="door"), b'{"position_m": [4, 5, 6]}')
    state = wait_until(lambda: (state := bench.state()).edits_rejected == 4 and state, "four refused edits")
    assert [poi.poi_id for poi in state.pois] == ["vase"]
    assert all("No space left on device" in edit.reason for edit in state.rejected_edits)
    assert any("No space left on device" in note for note in bench.health().notes)
    bench.put(topics.CAMERA_INFO, camera_info())
    show(bench, 1)

    disk.empty()
    assert stored(bench, "door", DOOR)
    assert bench.health().pid == pid
    assert ids(bench) == ["door", "vase"]
    bench.kill()
    bench.start()
    assert ids(bench) == ["door", "vase"]


def test_what_is_acknowledged_while_the_disk_fills_up_is_there_after_kill_9_and_a_start_on_the_full_disk(
    bench: Bench, disk: Disk
) -> None:
    acknowledged = ["vase"]
    wide = {"position_m": [1, 2, 3], "tags": ["x" * 60] * 8}
    for number in range(2000):
        if not stored(bench, f"p{number:04}", wide):
            break
        acknowledged.append(f"p{number:04}")
    assert 10 < len(acknowledged) < 2000, "the disk has become full by edits"
    disk.fill()
    bench.kill()
    bench.start()
    assert ids(bench) == sorted(acknowledged)
    assert not stored(bench, "door", DOOR)
    disk.empty()
    bench.kill()
    bench.start()
    assert ids(bench) == sorted(acknowledged)


def test_a_copy_that_finds_no_room_leaves_nothing_behind_and_is_said_in_the_log(bench: Bench, disk: Disk) -> None:
    disk.fill()
    assert bench.stop() == 0  # at its end it keeps a copy
    assert "no copy kept" in bench.log.read_text()
    assert [name for name in disk.files() if "fresh" in name] == []


def test_a_registry_on_a_read_only_disk_ends_the_start_with_path_and_cause(bench: Bench, disk: Disk) -> None:
    assert bench.stop() == 0
    disk.make_read_only()
    status, said = ended_with(bench)
    assert status == 78
    assert f"registry {bench.registry}: " in said
    assert f"({disk.path}: Read-only file system)" in said
    assert "Traceback" not in said
    bench.registry = disk.path / "new" / "pois.sqlite"
    status, said = ended_with(bench)
    assert (status, f"registry {bench.registry}: cannot be opened: " in said) == (78, True)
    assert "Read-only file system" in said


def test_a_registry_that_finds_no_room_to_begin_ends_the_start_with_path_and_cause(bench: Bench, disk: Disk) -> None:
    assert bench.stop() == 0
    disk.fill()
    bench.registry = disk.path / "other.sqlite"
    status, said = ended_with(bench)
    assert status == 78
    assert f"registry {bench.registry}: database or disk is full ({disk.path}: No space left on device)" in said


@pytest.fixture
def failing_disk(tmp_path: Path) -> Iterator[Disk]:
    (tmp_path / "failing").mkdir()
    if why := missing_for_failing_disk(tmp_path / "failing"):
        pytest.skip(why)
    with own_disk(tmp_path / "failing", "2M", FAILING) as it:
        yield it


def test_a_disk_that_turns_read_only_under_the_registry_refuses_edits_in_words_and_answers_go_on(
    endpoint: str, tmp_path: Path, failing_disk: Disk
) -> None:
    with fusion_bench(endpoint, tmp_path) as bench:
        bench.registry, bench.within = failing_disk.path / "pois.sqlite", failing_disk.within
        bench.start()
        assert stored(bench, "vase", VASE)
        failing_disk.find_an_error()
        for _ in range(2):
            refused = bench.ask("fusion/poi/door", DOOR)
            assert refused is not None
            assert refused[0] == "refused"
            assert refused[1].startswith(f"registry {bench.registry}: not written: ")
            assert f"({failing_disk.path}: Read-only file system)" in refused[1]
        assert ids(bench) == ["vase"]
        bench.put(topics.CAMERA_INFO, camera_info())
        show(bench, 1)
        bench.kill()
        status, said = ended_with(bench)
        assert status == 78
        assert f"({failing_disk.path}: Read-only file system)" in said
