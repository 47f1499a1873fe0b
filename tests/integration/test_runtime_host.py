"""A host starts whatever stage is installed, under whatever name."""

import os
import sys
import time

import pytest
from deixis_runtime import host
from deixis_runtime.healthcheck import router_problem, stage_problem
from deixis_runtime.host import Host, HostFailed, HostOptions, chosen_stages, installed_stages
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health
from running import BIN

ECHO = """
from deixis_runtime.settings import StageConfig
from deixis_runtime.stage import run_stage

class EchoConfig(StageConfig):
    loudness: int = 1

def serve(node, config):
    node.count("loudness", config.loudness)
    while node.wait():
        pass

run_stage("echo", EchoConfig, serve)
"""


@pytest.fixture
def echo_alone(tmp_path, monkeypatch):
    """An environment in which one stage is installed, called `echo`."""
    package, binaries = tmp_path / "echo-1.dist-info", tmp_path / "bin"
    package.mkdir()
    binaries.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: echo\nVersion: 1\n")
    (package / "entry_points.txt").write_text("[deixis.stages]\necho = echo:main\n")
    (tmp_path / "echo.py").write_text(ECHO)
    script(binaries / "python", f'exec {BIN / "python"} "$@"')
    script(binaries / "deixis-echo", f'exec {BIN / "python"} {tmp_path / "echo.py"} "$@"')
    monkeypatch.setattr(sys, "executable", str(binaries / "python"))
    monkeypatch.syspath_prepend(tmp_path)
    found = host.entry_points
    monkeypatch.setattr(host, "entry_points", lambda **which: [item for item in found(**which) if item.name == "echo"])


def script(path, text):
    path.write_text(f"#!/bin/sh\n{text}\n")
    os.chmod(path, 0o755)


@pytest.mark.usefixtures("echo_alone")
def test_a_stage_that_only_its_entry_point_names_is_started_with_its_settings(tmp_path, robot, free_port, wait_for):
    assert installed_stages() == {"echo"}
    site = tmp_path / "site.yaml"
    site.write_text("settings: {echo: {loudness: 7}}")
    options = HostOptions(robot=robot, stages=chosen_stages((), ()), site=site, listen=(f"tcp/127.0.0.1:{free_port}",))
    healths = []
    with Host(options) as running:

        def listen():
            key = topics.HEALTH.key(robot, stage="echo")
            healths.append(running.session.declare_subscriber(key))

        running.start(listen)
        (heard,) = healths
        sample = wait_for(heard.try_recv, "its health")
        health = codec.decode(Health, sample.payload.to_bytes(), str(sample.encoding))
        assert health.counters == {"loudness": 7}
        socket = running.endpoint.removeprefix("unixsock-stream/")
        assert router_problem(socket) == ""
        assert stage_problem("echo", robot, socket) == ""
        assert "no answer on" in stage_problem("camera", robot, socket)
        running.poll()
        assert running.given_up == {}


def test_a_stage_that_ends_while_the_others_start_fails_the_start(robot, free_port):
    sets = {"gesture": ("no_such_setting=1",)}
    options = HostOptions(robot=robot, stages=("gesture",), listen=(f"tcp/127.0.0.1:{free_port}",), sets=sets)
    began_s = time.monotonic()
    with Host(options) as running, pytest.raises(HostFailed, match="gesture ended while starting"):
        running.start()
    assert time.monotonic() - began_s < 25
