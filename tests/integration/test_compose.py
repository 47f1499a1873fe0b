"""The image and compose.yaml, built and run: the demo on one machine, and robot and edge as two projects."""

import os
import shutil
import signal
import subprocess

import pytest
from running import ROOT, child_called, free_port, wait_until

BASE = "python:3.11-slim-bookworm"
STAND_IN = ROOT.parent / "shared" / "tools" / "base-image"
STAGES = ("camera", "tracker", "headpose", "gesture", "fusion")
ROUTER = "unixsock-stream//run/deixis/router.sock"
BUILD_TIMEOUT_S = 900
RUN_TIMEOUT_S = 240
PATIENCE_S = 60


def run(*argv, timeout=60, check=True, **environment):
    """A command with its output."""
    done = subprocess.run(
        [*map(str, argv)],
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
        cwd=ROOT,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0 or not check, f"{argv}: {done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done


def engine_missing():
    """Why there is no engine to test with; empty if there is one."""
    if shutil.which("docker") is None:
        return "there is no docker command"
    answered = run("docker", "version", "--format", "{{.Server.Version}}", check=False)
    return f"no Docker engine answers: {answered.stderr.strip()}" if answered.returncode else ""


def compose_command():
    """`docker compose`, or the docker-compose of old; None where there is neither."""
    if run("docker", "compose", "version", check=False).returncode == 0:
        return ["docker", "compose"]
    return ["docker-compose"] if shutil.which("docker-compose") else None


WHY_NOT = engine_missing()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)]


def containers(project, service):
    """Names of a service's containers."""
    labels = {"com.docker.compose.project": project, "com.docker.compose.service": service}
    filters = [part for name, value in labels.items() for part in ("--filter", f"label={name}={value}")]
    return run("docker", "ps", "--format", "{{.Names}}", *filters).stdout.split()


def inspected(container, template):
    """What the engine says of a container."""
    return run("docker", "inspect", "--format", template, container).stdout.strip()


def hang(container, word):
    """Stop the process of a container that has the word in its command line; not the guard above it."""
    guard = int(inspected(container, "{{.State.Pid}}"))
    pid = child_called(guard, word)
    assert pid is not None, f"{container} has no guarded {word}"
    os.kill(pid, signal.SIGSTOP)


@pytest.fixture(scope="module")
def compose():
    """Runs compose on a project of ours; all of it is removed at the end."""
    command = compose_command()
    if command is None:
        pytest.skip("there is neither 'docker compose' nor docker-compose")
    started = []

    def on(project, profile, *arguments, timeout=60, check=True, **environment):
        started.append((project, profile))
        return run(*command, "-p", project, "--profile", profile, *arguments, timeout=timeout, check=check, **environment)

    yield on
    # The robot first: it is on the edge's network.
    for project, profile in reversed(dict.fromkeys(started)):
        run(*command, "-p", project, "--profile", profile, "down", "--volumes", "--timeout", "5", check=False, timeout=120)


@pytest.fixture(scope="module")
def images(compose):
    """The three images, built from this checkout."""
    if run("docker", "image", "inspect", BASE, check=False).returncode:
        pulled = run("docker", "pull", "--quiet", BASE, check=False, timeout=120)
        if pulled.returncode and not STAND_IN.exists():
            pytest.skip(f"the base image cannot be pulled: {pulled.stderr.strip()[-200:]}")
        if pulled.returncode:
            run(STAND_IN, BASE, timeout=BUILD_TIMEOUT_S)
    # BuildKit may be missing, and packages may be reached from the host's network only.
    compose("deixis-test", "demo", "build", timeout=BUILD_TIMEOUT_S, DEIXIS_BUILD_NETWORK="host", DOCKER_BUILDKIT="0")


@pytest.mark.usefixtures("images")
def test_the_demo_names_the_poi_and_succeeds(compose):
    environment = {"DEIXIS_PUBLISH": f"127.0.0.1:{free_port()}", "DEIXIS_ROBOT": "demo", "DEIXIS_OPTIONS": "--lockstep"}
    done = compose("deixis-test", "demo", "up", "--exit-code-from", "demo", timeout=RUN_TIMEOUT_S, **environment)
    assert "points at: the ship model (P3)" in done.stdout


@pytest.mark.usefixtures("images")
def test_robot_and_edge_name_the_poi_over_a_network_also_after_a_stage_hung(compose):
    common = {"DEIXIS_ROBOT": "r1", "DEIXIS_OPTIONS": "--lockstep", "timeout": RUN_TIMEOUT_S}
    compose("deixis-test-edge", "edge", "up", "-d", DEIXIS_PUBLISH=f"127.0.0.1:{free_port()}", **common)
    (edge,) = containers("deixis-test-edge", "router")
    compose(
        "deixis-test-robot", "robot", "up", "-d", DEIXIS_PUBLISH=f"127.0.0.1:{free_port()}",
        DEIXIS_CONNECT=f"tcp/{edge}:7447", DEIXIS_ENCODING="jpeg", **common,
    )  # fmt: skip
    # On one machine the two projects have networks of their own; this is the cable between them.
    (robot,) = containers("deixis-test-robot", "router")
    run("docker", "network", "connect", "deixis-test-edge_default", robot)

    (fusion,) = containers("deixis-test-edge", "fusion")
    ask = ("docker", "exec", fusion, "deixis", "watch", "--robot", "r1", "--connect", ROUTER, "--until-answer")
    right = run(*ask, "--seconds", "120", "--expect", "P3", timeout=RUN_TIMEOUT_S, check=False)
    assert right.returncode == 0, right.stdout + right.stderr
    assert "points at: the ship model (P3)" in right.stdout
    wrong = run(*ask, "--seconds", "120", "--expect", "P8", timeout=RUN_TIMEOUT_S, check=False)
    assert wrong.returncode == 1
    assert "expected the one answer 'P8'" in wrong.stderr

    hang(fusion, "deixis-fusion")
    again = "loop runs for 0.8 s); starting it again"
    wait_until(lambda: again in run("docker", "logs", fusion).stderr, "the guard starts fusion again", PATIENCE_S)
    assert inspected(fusion, "{{.RestartCount}}") == "0", "not the engine, which takes longer"
    (gesture,) = containers("deixis-test-edge", "gesture")
    ask = ("docker", "exec", gesture, "deixis", "poi", "list", "--robot", "r1", "--connect", ROUTER)
    wait_until(lambda: "the ship model" in run(*ask, check=False).stdout, "it answers the other containers", PATIENCE_S)


@pytest.mark.usefixtures("images")
def test_stages_have_no_network_no_privileges_and_a_read_only_root(compose):
    shown = compose("deixis-test", "demo", "config").stdout
    assert shown.count("network_mode: none") == len(STAGES) + 1, "all but the router"
    probe = "import os, socket; print(os.getuid(), [name for _, name in socket.if_nameindex()])"
    done = compose("deixis-test", "demo", "run", "--rm", "--no-deps", "tracker", "python", "-c", probe)
    assert done.stdout.split(maxsplit=1)[0] == "10001"
    assert "eth0" not in done.stdout
    write = compose("deixis-test", "demo", "run", "--rm", "--no-deps", "tracker", "touch", "/opt/x", check=False)
    assert write.returncode != 0
    assert "Read-only file system" in write.stderr + write.stdout


@pytest.mark.usefixtures("images")
def test_the_image_of_the_robot_holds_the_camera_alone():
    probe = "from importlib.metadata import entry_points; print(sorted(e.name for e in entry_points(group='deixis.stages')))"
    assert run("docker", "run", "--rm", "deixis-camera", "python", "-c", probe).stdout.strip() == "['camera']"


@pytest.mark.usefixtures("images")
def test_a_router_that_leaves_the_machine_wants_a_name_for_the_robot(compose):
    environment = {"DEIXIS_CONNECT": "tcp/10.0.0.1:7447", "DEIXIS_PUBLISH": f"127.0.0.1:{free_port()}", "DEIXIS_ROBOT": ""}
    done = compose("deixis-test-name", "robot", "run", "--rm", "router", check=False, **environment)
    assert done.returncode == 78
    assert "DEIXIS_ROBOT" in done.stderr + done.stdout
