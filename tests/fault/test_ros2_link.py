"""ROS's side of the bridge goes and comes back: its router, and the nodes there."""

import threading

import fake_ros
import numpy as np
import pytest
from deixis_ros2.config import RosConfig
from deixis_ros2.names import Qos
from deixis_ros2.ros_node import RosNode
from deixis_ros2.ros_types import RosTypes
from running import free_port, wait_until

TYPES = RosTypes("jazzy")
IMAGE = "sensor_msgs/msg/Image"
PATIENCE_S = 30.0
PICTURE = fake_ros.cdr_image(np.zeros((4, 6, 3), np.uint8), "rgb8", 5)


class Bridge:
    """A node that listens to a topic of pictures, and when it was woken."""

    def __init__(self, endpoint):
        self.woken = threading.Event()
        config = RosConfig(router=endpoint, domain=0, retry_s=0.1)
        self.node = RosNode(config, "deixis_test", TYPES, self.woken.set)
        self.pictures = self.node.subscribe(IMAGE, "/image_raw", Qos(), max_bytes=1000)
        self.node.start()

    def hears(self, put):
        def heard():
            put(PICTURE)
            return self.pictures.take()

        return wait_until(heard, "a picture", PATIENCE_S)


@pytest.fixture
def endpoint():
    return f"tcp/127.0.0.1:{free_port()}"


@pytest.fixture
def bridge(endpoint):
    made = Bridge(endpoint)
    yield made
    made.node.stop()


def test_a_router_that_comes_late_goes_and_comes_back_is_linked_to_each_time(bridge, endpoint):
    problem = wait_until(lambda: bridge.node.problem, "what is wrong", PATIENCE_S)
    assert f"no Zenoh router of ROS answers at {endpoint}" in problem
    assert "rmw_zenohd" in problem
    assert not bridge.node.linked
    for _ in range(2):
        with fake_ros.ros_router(endpoint), fake_ros.ros_peer(endpoint) as peer:
            wait_until(lambda: bridge.node.linked, "a link", PATIENCE_S)
            assert bridge.hears(peer.publisher("/image_raw", fake_ros.IMAGE)).payload == PICTURE
        wait_until(lambda: not bridge.node.linked, "no link", PATIENCE_S)
        assert "is cut" in bridge.node.problem


def test_who_publishes_the_topic_is_known_while_it_is_there(bridge, endpoint):
    with fake_ros.ros_router(endpoint):
        with fake_ros.ros_peer(endpoint) as peer:
            peer.publisher("/image_raw", fake_ros.IMAGE)
            (endpoint_found,) = wait_until(lambda: bridge.node.publishers_of("/image_raw"), "a publisher", PATIENCE_S)
            assert (endpoint_found.node, endpoint_found.dds_type) == ("/talker", "sensor_msgs::msg::dds_::Image_")
        wait_until(lambda: not bridge.node.publishers_of("/image_raw"), "nobody", PATIENCE_S)


def test_messages_too_large_without_attachment_or_faster_than_they_are_taken_are_counted_and_the_newest_is_kept(
    bridge, endpoint
):
    with fake_ros.ros_router(endpoint), fake_ros.ros_peer(endpoint) as peer:
        put = peer.publisher("/image_raw", fake_ros.IMAGE)
        sent = []
        bridge.hears(lambda picture: sent.append(put(picture)))
        wait_until(lambda: bridge.pictures.received == len(sent), "all that was sent", PATIENCE_S)
        bridge.pictures.take()
        put(bytes(1001))
        peer.session.put(f"0/image_raw/{fake_ros.IMAGE}", b"older")
        peer.session.put(f"0/image_raw/{fake_ros.IMAGE}", b"newest")
        wait_until(lambda: bridge.pictures.received == len(sent) + 3, "all three", PATIENCE_S)
        assert bridge.pictures.oversized == 1
        assert bridge.pictures.overwritten >= 1
        assert bridge.pictures.take().payload == b"newest"
        assert bridge.pictures.unattached == 1
