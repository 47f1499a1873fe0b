"""The soak benchmark: whether a slope is seen through noise, steps and single outliers, and what counts as flat."""

import random
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def bench(monkeypatch):
    """The benchmarks' folder, as for `python bench/soak.py`."""
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    yield
    for name in ("soak", "flatness", "process_use"):
        sys.modules.pop(name, None)


def series(per_hour, noise, minutes=30):
    chance = random.Random(1)
    times_s = [5.0 * i for i in range(12 * minutes)]
    return times_s, [100 + per_hour * at_s / 3600 + chance.gauss(0, noise) for at_s in times_s]


@pytest.mark.parametrize(("per_hour", "verdict"), [(0, "flat"), (1, "flat"), (4, "undecided"), (8, "grows"), (-8, "flat")])
def test_growth_is_told_from_noise(per_hour, verdict):
    from flatness import binned, theil_sen

    slope = theil_sen(*binned(*series(per_hour, noise=0.5), 60.0))
    assert slope.low <= per_hour <= slope.high
    assert slope.verdict(4.0) == verdict


def test_single_outliers_move_no_slope():
    from flatness import binned, theil_sen

    times_s, values = series(0, noise=0.1)
    values[-3:] = [900.0] * 3
    assert theil_sen(*binned(times_s, values, 60.0)).verdict(4.0) == "flat"


def test_what_never_changes_has_no_slope_and_too_little_is_undecided():
    from flatness import theil_sen

    slope = theil_sen([float(i) for i in range(20)], [7.0] * 20)
    assert (slope.low, slope.per_hour, slope.high) == (0.0, 0.0, 0.0)
    assert theil_sen([0.0, 1.0], [1.0, 2.0]) is None


def test_a_descriptor_that_leaks_makes_the_run_not_flat_and_resident_memory_is_not_judged():
    from soak import Samples, figures_of, findings_of

    samples = Samples()
    for i in range(360):
        grown = {("fusion", "descriptors"): 20 + i // 60, ("fusion", "rss_mb"): 90 + i, ("fusion", "threads"): 9}
        samples.add(5.0 * i, grown)
    findings = findings_of(samples)
    assert {what: finding.verdict for (_, what), finding in findings.items()} == {
        "descriptors": "grows", "rss_mb": "flat", "threads": "flat",
    }  # fmt: skip
    figures = figures_of(findings)
    assert figures["descriptors_fusion"] == 25
    assert figures["descriptors_fusion_low"] > 2


def test_what_a_process_holds_is_read_from_the_system():
    from process_use import ProcessEnded, cpu_s_of, use_of

    with subprocess.Popen([sys.executable, "-c", "import sys; print(1, flush=True); sys.stdin.read()"],
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:  # fmt: skip
        child.stdout.readline()
        use = use_of(child.pid)
        assert use.threads == 1
        assert use.descriptors >= 3
        assert 1 < use.pss_mb <= use.rss_mb < 200
        assert cpu_s_of(child.pid) >= 0
        child.stdin.close()
        child.wait(20)
    with pytest.raises(ProcessEnded, match=str(child.pid)):
        use_of(child.pid)
