"""Two robots on one edge, each with gesture and fusion of its own, by the benchmark of fleets."""

import sys
from pathlib import Path

import pytest
from deixis_runtime.interrupts import Interrupts

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def bench(monkeypatch):
    """The benchmarks' folder, as for `python bench/fleet.py`."""
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    yield
    for name in ("fleet", "fleet_player", "fleet_recording", "process_use"):
        sys.modules.pop(name, None)


def test_two_robots_are_answered_with_their_own_pois_alone():
    from fleet import measure

    with Interrupts() as interrupts:
        figures = measure(2, 10.0, interrupts)
    assert figures["foreign"] == 0
    assert figures["robots_unanswered"] == 0
    assert figures["right"] > 0.5 * figures["targets"]
