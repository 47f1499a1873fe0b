"""Shared by all tests: where the labelled data lie, free ports, waiting for conditions."""

import socket
import time
import uuid
from pathlib import Path

import pytest
from hypothesis import settings

# A busy machine makes no example wrong.
settings.register_profile("deixis", deadline=None)
settings.load_profile("deixis")

ROOT = Path(__file__).parents[1]
SHARED = ROOT.parent / "shared"


# Workers take file by file: one that takes minutes must not be the last. These begin, by how long they took; the second one
# builds a crate where it was not built before. Not beside each other are the pages and the containers: they start ten and more
# processes each, and on two slow processors containers were called unhealthy while they began.
LONGEST_FIRST = (
    "test_pages.py",
    "test_gesture_rust.py",
    "test_zenoh_cli.py",
    "test_simulation_command.py",
    "test_supervision_faults.py",
    "test_compose.py",
    "test_supervision_stages.py",
    "test_cli_system.py",
    "test_check_stage.py",
    "test_view.py",
    "test_two_hosts.py",
    "test_link.py",
    "test_rehearsal.py",
    "test_access.py",
    "test_systemd.py",
    "test_evaluation_stage.py",
    "test_garbage.py",
    "test_record_replay.py",
    "test_tutorial.py",
    "test_skewed_clock.py",
    "test_zenohd.py",
    "test_camera_process.py",
    "test_guests_mediapipe.py",
    "test_hot_swap.py",
    "test_paper_command.py",
    "test_registry_service.py",
    "test_hot_swap_faults.py",
    "test_ros2.py",
    "test_poi_edit.py",
)


def pytest_collection_modifyitems(items):
    """Begin with the files that take longest."""
    rank = {name: place for place, name in enumerate(LONGEST_FIRST)}
    items.sort(key=lambda item: rank.get(item.path.name, len(rank)))


@pytest.fixture(scope="session")
def clips():
    """Folder of the labelled clips that ship with the project."""
    return ROOT / "examples" / "clips"


@pytest.fixture(scope="session")
def rendered():
    """Folder of the whole labelled set; not at a user's."""
    folder = SHARED / "data" / "rendered"
    if not folder.is_dir():
        pytest.skip("the whole labelled set (../shared/data/rendered) is not here; the shipped clips stand for it")
    return folder


@pytest.fixture
def example_clip():
    """The clip that ships with the project."""
    return ROOT / "examples" / "pointing.mp4"


@pytest.fixture
def example_site():
    """The site of the clip that ships with the project."""
    return ROOT / "examples" / "pointing.yaml"


@pytest.fixture
def robot():
    """A robot name of this test's own: tests must never hear each other."""
    return f"test-{uuid.uuid4().hex[:8]}"


@pytest.fixture
def free_port():
    """A TCP port on loopback that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def wait_for():
    """Wait for a condition: `wait_for(lambda: x, 'what is awaited')` returns its first true value or fails the test."""

    def wait(condition, what, timeout_s=20.0):
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            value = condition()
            if value:
                return value
            time.sleep(0.02)
        pytest.fail(f"not within {timeout_s:.0f} s: {what}")

    return wait
