"""What the container's health check finds wrong."""

import os
import socket
import subprocess
import time
from pathlib import Path

import pytest
import zenoh
from deixis_runtime.healthcheck import health_problem, main, router_problem
from deixis_runtime.router import router_config
from deixis_schemas import codec
from deixis_schemas.messages import Health
from deixis_schemas.samples import SAMPLES

CONFIG = Path(__file__).parents[2] / "config"
HEALTH = next(message for message in SAMPLES if isinstance(message, Health))


def problem(**changes):
    health = HEALTH.model_copy(update=changes)
    return health_problem(codec.encode(health), codec.encoding_of(Health))


def test_a_router_that_routes_is_well_and_one_that_only_listens_is_not(tmp_path):
    path = str(tmp_path / "router.sock")
    config = router_config([f"unixsock-stream/{path}"], [])
    config.insert_json5("transport/shared_memory/enabled", "false")  # this process would keep 16 MB of it
    with zenoh.open(config):
        assert router_problem(path) == ""
    mute = str(tmp_path / "mute.sock")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(mute)
        listening.listen()
        assert "no Zenoh router answers" in router_problem(mute)


def test_a_router_that_is_not_there_is_named_with_its_socket(tmp_path, capsys):
    path = str(tmp_path / "router.sock")
    assert main(["router", "--socket", path]) == 1
    assert f"router: {path}: No such file" in capsys.readouterr().err


def test_a_stage_is_well_unless_it_says_that_it_has_failed():
    assert problem(state="ok") == ""
    assert problem(state="degraded", reason="the camera is silent") == ""
    assert problem(state="failed", reason="no such device") == f"{HEALTH.stage}: no such device"


def test_an_answer_that_breaks_the_contract_is_an_error():
    with pytest.raises(codec.CodecError):
        health_problem(b"garbage", codec.encoding_of(Health))


def test_a_stage_without_a_router_is_said(tmp_path, capsys):
    assert main(["tracker", "--robot", "r1", "--socket", str(tmp_path / "router.sock")]) == 1
    assert "tracker: no Zenoh router answers" in capsys.readouterr().err


def test_the_robot_has_to_be_known(monkeypatch, capsys):
    monkeypatch.delenv("DEIXIS_ROBOT", raising=False)
    with pytest.raises(SystemExit):
        main(["tracker"])
    assert "DEIXIS_ROBOT" in capsys.readouterr().err


@pytest.fixture
def check(tmp_path, monkeypatch):
    """Runs the container's script, with a Python that notes that it was asked and answers by its file `status`."""
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\necho "$@" >> {tmp_path}/asked\nexit $(cat {tmp_path}/status)\n')
    python.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    monkeypatch.setenv("TMPDIR", str(tmp_path))

    def run(status):
        (tmp_path / "status").write_text(str(status))
        return subprocess.run(["sh", CONFIG / "healthcheck.sh", "tracker"], check=False, timeout=20).returncode

    return run


def asked(folder):
    return (folder / "asked").read_text().splitlines()


def test_a_container_that_answered_is_not_asked_again_for_half_a_minute(check, tmp_path):
    assert check(0) == 0
    assert check(1) == 0
    assert asked(tmp_path) == ["-m deixis_runtime.healthcheck tracker"]
    long_ago = time.time() - 31
    os.utime(tmp_path / "answered", (long_ago, long_ago))
    assert check(1) == 1
    assert len(asked(tmp_path)) == 2


def test_a_container_that_did_not_answer_is_asked_each_time(check, tmp_path):
    assert [check(1), check(1), check(0)] == [1, 1, 0]
    assert len(asked(tmp_path)) == 3
