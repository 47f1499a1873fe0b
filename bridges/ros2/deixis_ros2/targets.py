"""fusion/target as deixis_msgs/PointedTarget. Pure."""

from __future__ import annotations

import math
from typing import Any

from deixis_schemas.messages import PoiBelief, Target

from .ros_types import RosTypes

POINTED_TARGET, POINTED_POI = "deixis_msgs/msg/PointedTarget", "deixis_msgs/msg/PointedPoi"


def pointed_target(types: RosTypes, target: Target, map_frame: str) -> Any:
    """The message to ROS that says the same."""
    return types.make(
        POINTED_TARGET,
        header=types.header(target.stamp_ns, map_frame),
        episode_id=target.episode_id,
        person_id=person_name(target.person_id),
        is_final=target.final,
        poi_ids=list(target.poi_ids),
        pois=[_poi(types, poi) for poi in target.pois],
        pois_total=min(target.pois_total, 2**32 - 1),
        credible=list(target.credible),
        conflict=target.conflict,
        reason=target.reason,
        started=types.time(target.started_ns),
        ended=types.time(target.ended_ns),
        latency_ms=target.latency_ms,
    )


def person_name(person_id: int) -> str:
    """How ROS4HRI names a person's face and body: a part of a topic's name must not begin with a digit."""
    return f"p{person_id}"


def _poi(types: RosTypes, poi: PoiBelief) -> Any:
    return types.make(
        POINTED_POI,
        poi_id=poi.poi_id,
        mass=poi.mass,
        belief=poi.belief,
        plausibility=poi.plausibility,
        pignistic=poi.pignistic,
        probability=math.nan if poi.probability is None else poi.probability,
        bearing_deg=math.nan if poi.bearing_deg is None else poi.bearing_deg,
    )
