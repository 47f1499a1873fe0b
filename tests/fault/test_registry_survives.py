"""The registry after kill -9, beside a second process, and on files that are no registry."""

from __future__ import annotations

import contextlib
import random
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from deixis_fusion.registry import Put, Registry, RegistryError, copy_of
from deixis_fusion.registry_recovery import open_registry_file
from deixis_schemas.messages import Poi

# Edits as fast as it can; says so of each once it is acknowledged.
WRITER = """
import sys
from pathlib import Path
from deixis_fusion.registry import Registry
from deixis_schemas.messages import Poi

registry = Registry(Path(sys.argv[1]))
start = int(sys.argv[2])
print("ready", flush=True)
for i in range(start, start + 100_000):
    registry.put(Poi(poi_id=f"p{i % 40}", name=str(i), position_m=(i, 0, 0)))
    print("put", i % 40, i, flush=True)
    if i % 3 == 0:
        registry.delete(f"p{i % 40}")
        print("delete", i % 40, i, flush=True)
"""


def poi(poi_id: str, x: float = 0.0) -> Poi:
    return Poi(poi_id=poi_id, position_m=(x, 0, 0))


def kill_a_writer(path: Path, start: int, after: int) -> list[tuple[str, int, int]]:
    """Start a writer, kill it with SIGKILL after so many acknowledgements; returns all that it acknowledged."""
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(path), str(start)], stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None
    assert writer.stdout.readline() == "ready\n"
    lines = [writer.stdout.readline() for _ in range(after)]
    writer.send_signal(signal.SIGKILL)
    # What it wrote just before it died; a line cut short was not said. `communicate` with a timeout reads past the lines that
    # `readline` has buffered: under load several edits that were acknowledged seemed not to be.
    rest = writer.stdout.read()
    assert writer.wait(timeout=20) == -signal.SIGKILL
    lines += rest[: rest.rfind("\n") + 1].splitlines()
    return [(kind, int(slot), int(number)) for kind, slot, number in (line.split() for line in lines)]


def test_no_acknowledged_edit_is_lost_by_kill_9(tmp_path: Path) -> None:
    path, chance = tmp_path / "pois.sqlite", random.Random(1)
    known: dict[int, int] = {}
    start = 0
    for _ in range(6):
        for kind, slot, number in kill_a_writer(path, start, chance.randint(5, 60)):
            known.pop(slot, None)
            if kind == "put":
                known[slot] = number
            start = number + 1
        registry = Registry(path)
        stored = {int(p.poi_id[1:]): int(p.name) for p in registry.pois()}
        registry.close()
        # Killed between commit and acknowledgement, it is ahead of what it said: by one edit, never behind.
        ahead = [slot for slot in set(stored) | set(known) if stored.get(slot) != known.get(slot)]
        assert len(ahead) <= 1
        assert all(slot in ((start - 1) % 40, start % 40) for slot in ahead)
        assert all(stored.get(slot, start) >= known.get(slot, 0) for slot in ahead)
        known = stored


def test_a_second_registry_on_the_same_file_is_refused_soon_and_clearly(tmp_path: Path) -> None:
    path = tmp_path / "pois.sqlite"
    first = Registry(path)
    began = time.monotonic()
    with pytest.raises(RegistryError, match=r"pois\.sqlite: is locked by another process"):
        Registry(path)
    assert time.monotonic() - began < 5
    first.put(poi("a"))
    first.close()
    assert [p.poi_id for p in Registry(path).pois()] == ["a"]


def test_a_file_that_is_no_database_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "pois.sqlite"
    path.write_bytes(b"this is no database, " * 100)
    with pytest.raises(RegistryError, match=r"pois\.sqlite: is corrupt: .*; no good copy is beside it"):
        open_registry_file(path)
    assert path.read_bytes().startswith(b"this is no database")
    assert [other.name for other in tmp_path.iterdir()] == ["pois.sqlite"]


def filled(path: Path) -> None:
    """A registry with 300 POIs of which a copy is kept, and one more."""
    registry = Registry(path)
    registry.apply([Put(poi(f"p{i}")) for i in range(300)])
    registry.keep_copy()
    registry.put(poi("later"))
    registry.close()


def zero_all_but_the_first_page(path: Path) -> bytes:
    content = bytearray(path.read_bytes())
    content[4096:] = bytes(len(content) - 4096)
    path.write_bytes(content)
    return bytes(content)


def overwrite(path: Path) -> bytes:
    path.write_bytes(b"this is no database any more, " * 100)
    return path.read_bytes()


def cut_off(path: Path) -> bytes:
    path.write_bytes(path.read_bytes()[:5000])
    return path.read_bytes()


def execute(path: Path, statement: str) -> bytes:
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute(statement)
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return path.read_bytes()


def break_an_entry(path: Path) -> bytes:
    return execute(path, "UPDATE pois SET content = '{}' WHERE poi_id = 'p7'")


def break_an_entry_of_the_site(path: Path) -> bytes:
    return execute(path, "INSERT INTO baseline VALUES ('p7', '{}')")


def exchange_an_id(path: Path) -> bytes:
    return execute(path, "UPDATE pois SET poi_id = 'p7000' WHERE poi_id = 'p7'")


def lose_a_table(path: Path) -> bytes:
    return execute(path, "DROP TABLE pois")


def flip_a_bit_of_a_text(path: Path) -> bytes:
    content = path.read_bytes()
    assert content.count(b'"poi_id":"p77"') == 1
    path.write_bytes(content.replace(b'"poi_id":"p77"', b'"poi_id":"p7\xb7"'))
    return path.read_bytes()


def empty(path: Path) -> bytes:
    path.write_bytes(b"")
    return b""


DAMAGES = [
    zero_all_but_the_first_page,
    overwrite,
    cut_off,
    break_an_entry,
    break_an_entry_of_the_site,
    exchange_an_id,
    lose_a_table,
    flip_a_bit_of_a_text,
    empty,
]


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_registry_is_set_aside_and_its_last_good_copy_used(tmp_path: Path, damage: Callable[[Path], bytes]) -> None:
    path = tmp_path / "pois.sqlite"
    filled(path)
    damaged = damage(path)
    registry, told = open_registry_file(path)
    assert "is corrupt" in told
    assert "set aside as pois.sqlite.corrupt-1, and its last good copy is used, 300 POIs of " in told
    assert (tmp_path / "pois.sqlite.corrupt-1").read_bytes() == damaged
    assert len(registry.pois()) == 300
    registry.put(poi("after"))
    registry.close()
    again, told = open_registry_file(path)
    assert (len(again.pois()), told) == (301, "")


def test_what_was_set_aside_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "pois.sqlite"
    filled(path)
    for number in (1, 2):
        overwrite(path)
        registry, told = open_registry_file(path)
        assert f"pois.sqlite.corrupt-{number}," in told
        registry.close()


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_copy_takes_no_registrys_place(tmp_path: Path, damage: Callable[[Path], bytes]) -> None:
    path = tmp_path / "pois.sqlite"
    filled(path)
    overwrite(path)
    damage(copy_of(path))
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(RegistryError, match=r"is corrupt: .*; its last good copy pois\.sqlite\.good cannot take its place: "):
        open_registry_file(path)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


@pytest.mark.parametrize("damage", [zero_all_but_the_first_page, overwrite])
def test_damage_while_it_is_open_never_reaches_the_copy(tmp_path: Path, damage: Callable[[Path], bytes]) -> None:
    path = tmp_path / "pois.sqlite"
    filled(path)
    registry = Registry(path)
    damage(path)
    with contextlib.suppress(RegistryError):
        registry.keep_copy()
    registry.close()
    assert open_registry_file(copy_of(path))[1] == ""


def test_a_copy_that_cannot_be_kept_is_an_error_in_words(tmp_path: Path) -> None:
    registry = Registry(tmp_path / "pois.sqlite")
    registry.put(poi("a"))
    copy_of(tmp_path / "pois.sqlite").mkdir()
    with pytest.raises(RegistryError, match=r"pois\.sqlite: no copy kept: "):
        registry.keep_copy()
    registry.put(poi("b"))
    assert len(registry.pois()) == 2


def test_an_entry_that_breaks_the_contract_is_named(tmp_path: Path) -> None:
    path = tmp_path / "pois.sqlite"
    Registry(path).close()
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("INSERT INTO pois VALUES ('vase', '{\"poi_id\": \"vase\"}')")
    with pytest.raises(RegistryError, match="the entry 'vase' is corrupt: position_m"):
        Registry(path)


def test_another_programs_database_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "theirs.sqlite"
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("CREATE TABLE recipes (name TEXT)")
    with pytest.raises(RegistryError, match="something else"):
        Registry(path)


def test_a_newer_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "pois.sqlite"
    Registry(path).close()
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("PRAGMA user_version = 7")
    with pytest.raises(RegistryError, match="has format 7"):
        Registry(path)


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RegistryError, match="cannot be opened"):
        Registry(tmp_path / "file" / "pois.sqlite")
    with pytest.raises(RegistryError, match="registry"):
        Registry(tmp_path)
