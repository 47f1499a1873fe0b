"""A stage in another language: the guest in Rust is built, keeps the contract, and its evidence counts."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from running import CLIP, POINTED_AT, ROOT, command, process, system, wait_until

CRATE = ROOT / "guests" / "gesture_rust"
# The build takes a minute or two, and each clean checkout would begin anew.
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "deixis" / "gesture_rust"

pytestmark = pytest.mark.skipif(shutil.which("cargo") is None, reason="cargo is not here: the guest in Rust is not built")


def cargo(*arguments, timeout):
    environment = {**os.environ, "CARGO_TARGET_DIR": str(CACHE)}
    # No lock file is kept: it would name a registry's host.
    return subprocess.run(
        ["cargo", *arguments, "--manifest-path", str(CRATE / "Cargo.toml")],
        capture_output=True, text=True, timeout=timeout, check=False, env=environment,
    )  # fmt: skip


@pytest.fixture(scope="module")
def guest():
    """The built guest's command, without options."""
    fetched = cargo("fetch", timeout=120)
    if fetched.returncode != 0:
        pytest.skip(f"the crates of the guest in Rust cannot be fetched here: {fetched.stderr.strip().splitlines()[-1]}")
    built = cargo("build", timeout=540)
    assert built.returncode == 0, built.stderr[-3000:]
    return CACHE / "debug" / "gesture_rust"


@pytest.mark.timeout(600)
def test_it_keeps_the_contract(guest):
    done = subprocess.run(
        command("deixis", "check-stage", "gesture", "--command", f"{guest} --robot {{robot}} --connect {{connect}}", "--json"),
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    wrong = [item for item in json.loads(done.stdout)["checks"] if item["outcome"] != "passed"]
    assert (done.returncode, wrong) == (0, [])


@pytest.mark.usefixtures("guest")
def test_its_own_tests_pass():
    tested = cargo("test", timeout=540)
    assert tested.returncode == 0, tested.stdout[-3000:] + tested.stderr[-3000:]
    assert "6 passed" in tested.stdout


def test_an_answer_rests_on_its_evidence(tmp_path, robot, guest):
    with (
        system(tmp_path, robot, "--except", "gesture", clip=CLIP) as running,
        process([guest, "--robot", robot, "--connect", running.endpoint], tmp_path / "guest"),
    ):

        def answered():
            for target in running.state().get("recent_targets", []):
                evidence = {item["source"]: item for item in target["evidence"]}
                if evidence["gesture"]["producer"].startswith("gesture/rust-"):
                    return target
            return None

        target = running.wait_until(answered, "an answer that rests on the guest's gesture", 120)
        assert POINTED_AT in target["poi_ids"], target["reason"]


def test_it_takes_the_place_of_a_running_stage_between_two_frames(tmp_path, robot, guest):
    with system(tmp_path, robot) as running:
        running.wait_until(lambda: running.state().get("last_seq", -1) > 0, "frames to be answered", 60)
        # Of two in one place: first the guest takes ours, then one of ours the guest's; it yields as it takes.
        argv = ["--robot", robot, "--connect", running.endpoint, "--watch", "0.3", "--json"]
        start = f"{guest} --robot {{robot}} --connect {{connect}}"
        log = tmp_path / "swap"
        with process(command("deixis", "swap", "gesture", "--command", start, *argv), log) as child:
            wait_until(lambda: "runs here until Ctrl-C" in log.read_text() or child.poll() is not None, "the swap", 90, log)
            first = next(json.loads(line) for line in log.read_text().splitlines() if line.startswith("{"))
            assert first["new"].startswith("rust-")
            ours = command(
                "deixis-gesture", "--robot", robot, "--connect", running.endpoint, "--instance", "ours", "--stand-by"
            )
            with process([*ours, "--lockstep"], tmp_path / "ours"):
                back = subprocess.run(
                    command("deixis", "swap", "gesture", "--instance", "ours", *argv),
                    capture_output=True, text=True, timeout=90, check=False,
                )  # fmt: skip
                assert back.returncode == 0, back.stderr
                second = json.loads(back.stdout)
                assert (second["old"], second["new"]) == (first["new"], "ours")
        assert [cost[name] for cost in (first, second) for name in ("gap_frames", "twice", "unanswered")] == [0] * 6
