"""Why no pictures come from ROS, from what is known of its graph. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from .names import Endpoint, dds_type


def why_silent(topic: str, type_name: str, type_hash: str, publishers: Sequence[Endpoint]) -> str:
    """One sentence: nobody publishes the topic, or another type, or nobody sends anything."""
    if not publishers:
        return f"no ROS node publishes {topic}: 'ros2 topic list' names the topics; the domain may be another"
    wanted = dds_type(type_name)
    fitting = [endpoint for endpoint in publishers if endpoint.dds_type == wanted]
    who = ", ".join(endpoint.node for endpoint in (fitting or publishers)[:4])
    if not fitting:
        return f"{topic} carries {publishers[0].dds_type} by {who}, not {wanted}: see the settings image and compressed"
    if all(endpoint.type_hash != type_hash for endpoint in fitting):
        return (
            f"{topic} carries another version of {type_name} by {who} ({fitting[0].type_hash[:40]}): "
            "name the ROS distribution in ros.distribution"
        )
    return f"{topic} is there, but {who} sends nothing"
