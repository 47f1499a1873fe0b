"""Whether those who read frames are on the camera's host: by the router that each is a client of."""

import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager

import pytest
from deixis_runtime.session import open_client
from deixis_runtime.settings import CommonOptions
from deixis_runtime.stage import Node
from deixis_schemas import topics
from running import answers, free_port


@contextmanager
def router(wait_for, *arguments):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    process = subprocess.Popen([sys.executable, "-m", "deixis_runtime.router", "--listen", endpoint, *arguments])
    wait_for(lambda: answers(endpoint), "the router listens")
    try:
        yield endpoint
    finally:
        process.terminate()
        process.wait(10)


@contextmanager
def stage(name, robot, endpoint, topic=None):
    """A stage that listens to a topic, its loop on a thread."""
    with open_client(endpoint, shared_memory=False) as session:
        node = Node(session, name, CommonOptions(robot, f"{name}-1", endpoint, False, False, 0, None, ()))
        if topic is not None:
            node.subscribe(topic)
        thread = threading.Thread(target=lambda: [None for _ in iter(node.wait, False)])
        thread.start()
        try:
            yield node
        finally:
            node.stop()
            thread.join(5)


@pytest.fixture(scope="module")
def routers():
    """Those of two hosts, linked."""

    def wait_for(condition, what):
        deadline = time.monotonic() + 20
        while not condition():
            assert time.monotonic() < deadline, what
            time.sleep(0.05)

    with router(wait_for) as edge, router(wait_for, "--connect", edge) as robot:
        yield robot, edge


def settled(readers):
    readers.turn()
    return not readers.unsettled() and readers


def test_stages_on_the_cameras_router_are_on_its_host(routers, robot, wait_for):
    ours, _ = routers
    with stage("tracker", robot, ours, topics.FRAME), stage("camera", robot, ours) as camera:
        readers = camera.follow_readers(topics.FRAME)
        wait_for(lambda: ("tracker" in camera.alive_stages()) and settled(readers), "the tracker says where it is")
        assert readers.elsewhere() == set()


def test_a_stage_that_reads_frames_on_another_router_is_elsewhere_and_one_that_reads_none_does_not_count(
    routers, robot, wait_for
):
    ours, theirs = routers
    with ExitStack() as stack:
        camera = stack.enter_context(stage("camera", robot, ours))
        stack.enter_context(stage("gesture", robot, theirs, topics.TRACKS))
        readers = camera.follow_readers(topics.FRAME)
        wait_for(lambda: ("gesture" in camera.alive_stages()) and settled(readers), "gesture says where it is")
        assert readers.elsewhere() == set()
        stack.enter_context(stage("tracker", robot, theirs, topics.FRAME))
        wait_for(lambda: settled(readers) and readers.elsewhere(), "the tracker says where it is")
        assert len(readers.elsewhere()) == 1
