"""`deixis paper` as a command."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import cv2
import pytest
from refused import refused

DEIXIS = Path(sys.executable).parent / "deixis"
ROWS = {"N", "n_av", "Corm", "Cors", "False", "Vh", "Ch", "Vf", "Cf"}


def paper(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([DEIXIS, "paper", *arguments], capture_output=True, text=True, timeout=120, check=False)


def test_tables_ours_beside_the_published_ones_with_intervals_and_what_was_assumed(tmp_path: Path) -> None:
    done = paper("--json", tmp_path / "out" / "paper.json")
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / "out" / "paper.json").read_text())
    assert set(content["rooms"]) == set(content["published"]) == {"A", "B", "C"}
    assert all(set(room) == ROWS for room in (*content["rooms"].values(), *content["published"].values()))
    assert content["rooms"]["A"]["N"] == 1000
    assert content["published"]["B"]["Cors"] == 0.819
    assert all(low <= content["rooms"]["B"][row] <= high for row, (low, high) in content["intervals"]["B"].items())
    assert content["seconds"] < 3 * 2
    assert any("phi_f-max" in sentence for sentence in content["assumptions"])
    assert all(f"Table {i}" in done.stdout for i in (1, 2, 3))
    assert all(sentence in done.stdout for sentence in content["assumptions"])
    assert f"{100 * content['rooms']['A']['Corm']:.1f} (" in done.stdout
    assert "mismatch" not in content


def test_deixis_mode_runs_on_the_same_trials(tmp_path: Path) -> None:
    for mode in ("paper", "deixis"):
        assert paper("--trials", "300", "--seed", "3", "--mode", mode, "--json", tmp_path / mode).returncode == 0
    by_paper, by_deixis = (json.loads((tmp_path / mode).read_text()) for mode in ("paper", "deixis"))
    assert by_deixis["modes"]["paper"] == by_paper["rooms"]
    assert by_deixis["rooms"] == by_deixis["modes"]["deixis"] != by_paper["rooms"]
    assert by_deixis["rooms"]["C"]["Vh"] == by_paper["rooms"]["C"]["Vh"]


def test_mismatch_is_told_of_every_rule(tmp_path: Path) -> None:
    done = paper("--trials", "2000", "--mismatch", "0.2", "--json", tmp_path / "paper.json")
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / "paper.json").read_text())
    rules = content["mismatch"]
    assert {"dempster", "yager", "dubois_prade", "pcr6", "deixis"} <= set(rules)
    assert all(0 <= rule["answered"] <= 1 and rule["answered_above_0.9"] <= rule["answered"] for rule in rules.values())
    assert rules["deixis"]["wrong_above_0.9"] <= 0.01
    assert rules["deixis"]["answered"] >= 0.5
    assert rules["dempster"]["wrong_above_0.9"] > 0.05
    assert content["mismatch_conflict"]["mismatched"] > content["mismatch_conflict"]["matched"]
    assert all(rule in done.stdout for rule in rules)


def test_figures_5_to_8_are_drawn(tmp_path: Path) -> None:
    done = paper("--trials", "10", "--out", tmp_path / "figures")
    assert done.returncode == 0, done.stderr
    for number in (5, 6, 7, 8):
        picture = cv2.imread(str(tmp_path / "figures" / f"fig{number}.png"))
        assert picture is not None
        assert picture.std() > 10


def test_a_measured_table_1_changes_what_is_recognised(tmp_path: Path) -> None:
    table = {
        "point_left": {"left": 0.5, "center": 0.0, "right": 0.0},
        "invisible": {"left": 0.5, "center": 1.0, "right": 0.5},
        "point_right": {"left": 0.0, "center": 0.0, "right": 0.5},
    }
    (tmp_path / "table.json").write_text(json.dumps({"table": table, "source": "measured here"}))
    done = paper("--set", f"fusion.confusion.hand={tmp_path / 'table.json'}", "--json", tmp_path / "paper.json")
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / "paper.json").read_text())
    assert content["table_1"]["point_left"]["left"]["share"] == pytest.approx(0.5, abs=0.05)
    assert content["table_1"]["point_left"]["left"]["published"] == 0.9
    assert "Table 1: measured here." in content["assumptions"]


@pytest.mark.parametrize(
    ("arguments", "status", "complaint"),
    [
        (("--trials", "0"), 2, "not a whole number from 1"),
        (("--trials", "many"), 2, "not a whole number"),
        (("--seed", "-1"), 2, "not a whole number from 0"),
        (("--mismatch", "1.5"), 2, "not a share from 0 to 1"),
        (("--mismatch", "nan"), 2, "not a share from 0 to 1"),
        (("--mode", "other"), 2, "invalid choice"),
        (("--set", "tracker.x=1"), 1, "the simulation has fusion's settings alone"),
        (("--set", "fusion.paper.phi_f_max_deg=0"), 1, "paper.phi_f_max_deg"),
        (("--set", "fusion.confusion.hand=/nowhere.yaml"), 1, "confusion.hand: confusion table /nowhere.yaml: No such file"),
        (("--json", "/proc/nowhere/paper.json"), 1, "--json /proc/nowhere/paper.json"),
        (("--out", "/proc/nowhere"), 1, "--out /proc/nowhere"),
    ],
)
def test_what_cannot_be_is_refused_and_said(
    arguments: tuple[str, ...], status: int, complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    became, said = refused(capsys, "paper", "--trials", "10", *arguments)
    assert became == status
    assert complaint in said


def test_a_terminal_is_shown_how_far_the_trials_are_and_nothing_else_is() -> None:
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    shown = []
    with subprocess.Popen(
        [DEIXIS, "paper", "--trials", "30000"], stdout=subprocess.DEVNULL, stderr=theirs, env=environment
    ) as process:
        os.close(theirs)
        with os.fdopen(ours, "rb", buffering=0) as screen, contextlib.suppress(OSError):  # EIO: nobody writes there any more
            while part := screen.read(65536):
                shown.append(part)
    assert process.returncode == 0
    counted = {int(count) for count in re.findall(rb"(\d+)/90000", b"".join(shown))}
    assert len(counted) >= 3, "the bar moves"
    assert max(counted) == 90000
    piped = paper("--trials", "3000")
    assert "/9000" not in piped.stderr
