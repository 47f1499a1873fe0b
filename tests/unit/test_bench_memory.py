"""The memory benchmark: what a process's memory and time are counted as."""

import os
import sys
import time
from pathlib import Path

import pytest
from deixis_schemas import topics

ROOT = Path(__file__).parents[2]
SMAPS = """\
55e0-55e1 rw-p 00000000 00:00 0                          [heap]
Rss:                2048 kB
Pss:                1024 kB
Anonymous:          2048 kB
7f00-7f01 r-xp 00000000 08:01 11                         /usr/lib/a library.so
Pss:                 512 kB
7f02-7f03 rw-p 00000000 00:00 0
Pss:                3072 kB
7f04-7f05 rw-s 00000000 00:1a 5                          /dev/shm/1.zenoh (deleted)
Pss:                4096 kB
7ffc-7ffd rw-p 00000000 00:00 0                          [stack]
Pss:                 128 kB
"""


@pytest.fixture(autouse=True)
def bench(monkeypatch):
    """The benchmarks' folder, as for `python bench/memory.py`."""
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    yield
    for name in ("memory", "process_parts", "process_use"):
        sys.modules.pop(name, None)


def test_each_mapping_counts_to_one_part():
    from process_parts import LIBRARIES, OBJECTS, SHARED, STACKS, parse_parts

    assert parse_parts(SMAPS) == {OBJECTS: 4.0, LIBRARIES: 0.5, SHARED: 4.0, STACKS: 0.125}


def test_the_parts_of_a_process_are_what_it_holds():
    from process_parts import parts_of
    from process_use import use_of

    assert sum(parts_of(os.getpid()).values()) == pytest.approx(use_of(os.getpid()).pss_mb, rel=0.05)


def test_the_time_of_the_main_thread_is_that_of_the_loop():
    from process_parts import LOOP, OTHER, thread_seconds

    before, began_s = thread_seconds(os.getpid()), time.thread_time()
    while time.thread_time() - began_s < 0.1:
        pass
    after = thread_seconds(os.getpid())
    assert after[LOOP] - before[LOOP] == pytest.approx(0.1, abs=0.05)
    assert after[OTHER] - before[OTHER] < 0.05


def test_processes_are_told_by_their_command_lines():
    from memory import FORKSERVER, ROUTER, name_of

    assert name_of("python -m deixis_runtime.router --listen x") == ROUTER
    assert name_of("/bin/python\0-m\0deixis_runtime.forkserver\0") == FORKSERVER
    assert [name_of(f"/x/deixis-{stage} --robot r") for stage in topics.STAGES] == list(topics.STAGES)
    with pytest.raises(ValueError, match="none of ours"):
        name_of("sleep 5")


def test_time_is_counted_by_frame_and_process():
    from memory import cpu_figures

    figures = cpu_figures({"a": {"loop": 1.0, "zenoh": 0.5}, "b": {"loop": 0.25}}, 100)
    assert figures == {
        "cpu_ms_a_loop": 10,
        "cpu_ms_a_zenoh": 5,
        "cpu_ms_b_loop": 2.5,
        "cpu_ms_a": 15,
        "cpu_ms_b": 2.5,
        "cpu_ms": 17.5,
    }
