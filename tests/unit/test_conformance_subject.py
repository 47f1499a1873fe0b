"""The process of a stage under check: what it prints is bounded, and nothing of it stays."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from deixis_conformance.subject import TAIL_BYTES, Subject, SubjectError
from running import wait_until

FLOODS = "import sys\nwhile True: sys.stdout.write('no model file ' * 10_000); sys.stdout.flush()"


def subject(*words):
    return Subject(" ".join(words) + " {robot} {connect}", "r1", "tcp/127.0.0.1:1")


def test_of_a_stage_that_prints_without_end_only_the_end_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with subject(sys.executable, "-c", f'"{FLOODS}"') as flooding:
        wait_until(lambda: len(flooding.last_words()) > TAIL_BYTES // 2, "its words", 10)
        time.sleep(0.2)  # 0.1 GB of them, if they were kept
        assert sum(file.stat().st_size for file in tmp_path.rglob("*")) == 0
        assert len(flooding.last_words()) <= TAIL_BYTES


def test_what_the_command_has_started_ends_with_it(tmp_path):
    number = tmp_path / "pid"
    with subject("sh", "-c", f"'sleep 60 & echo $! > {number}; wait'"):
        wait_until(lambda: number.exists() and number.read_text(), "a child", 10)
        child = Path("/proc") / number.read_text().strip()
        assert child.exists()
    wait_until(lambda: not child.exists() or " Z " in (child / "stat").read_text(), "its end", 5)


def test_the_last_words_of_who_has_ended_are_all_there():
    with subject("sh", "-c", "'seq 1000; echo the model is missing'") as ended:
        wait_until(lambda: not ended.running(), "its end", 10)
        assert ended.last_words().endswith("999\n1000\nthe model is missing")
        assert ended.status() == 0


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["/none/such"], "'/none/such' cannot be started: No such file"),
        (["a\0b"], "cannot be started: embedded null byte"),
        (["/etc"], "'/etc' cannot be started: Permission denied"),
    ],
)
def test_a_command_that_cannot_be_started_is_named(words, text):
    with pytest.raises(SubjectError, match=text), subject(*words):
        pass


def test_who_is_told_to_stop_checking_leaves_no_stage_behind(tmp_path):
    number = tmp_path / "pid"
    start = f"sh -c 'echo $$ > {number}; exec sleep 60' {{robot}} {{connect}}"
    argv = [str(Path(sys.executable).parent / "deixis"), "check-stage", "gesture", "--command", start]
    with subprocess.Popen(argv, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as checking:
        wait_until(lambda: number.exists() and number.read_text(), "the stage", 20)
        checking.terminate()
        assert checking.wait(10) == 143
    wait_until(lambda: not (Path("/proc") / number.read_text().strip()).exists(), "the end of the stage", 5)
