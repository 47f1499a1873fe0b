"""Who walks in to do something: stands and looks the right way when it begins, without a jump at either end of the walk."""

from __future__ import annotations

import math

import numpy as np
import pytest
from deixis_simulation.actor import Actor
from deixis_simulation.geometry import to_world, wrap_deg
from deixis_simulation.scene import Person, Pointing, Scene, ScenePoi, Walk
from hypothesis import given, settings
from hypothesis import strategies as st

START, PLACE = (2.6, 1.8), (2.4, 0.0)
DISTANCE_M = math.dist(START, PLACE)
ALONG_DEG = math.degrees(math.atan2(PLACE[1] - START[1], PLACE[0] - START[0]))
SETTLE_S = 0.5
"""After distance / speed: the drawn scripts let the next action begin then."""


def arriving(heading_deg: float, speed_m_s: float = 1.1, restlessness: float = 0.0, seed: int = 0, poi_y: float = 2.5) -> Actor:
    walk = Walk(start_s=0.2, to_m=PLACE, speed_m_s=speed_m_s, heading_deg=heading_deg)
    begin_s = 0.2 + DISTANCE_M / speed_m_s + SETTLE_S
    pointing = Pointing(start_s=begin_s, preparation_s=0.4, hold_s=1.2, poi="a", arm="left" if poi_y > 0 else "right")
    person = Person(
        avatar="White_F_1_Casual", place_m=START, heading_deg=ALONG_DEG, restlessness=restlessness, actions=[walk, pointing]
    )
    scene = Scene(duration_s=9, seed=seed, pois=[ScenePoi(poi_id="a", position_m=(2.0, poi_y, 1.0))], people=[person])
    return Actor(person, scene, 0)


@settings(max_examples=30, deadline=None)
@given(heading=st.floats(-180, 180), speed=st.floats(0.5, 2.0))
def test_a_walk_ends_in_time_whatever_the_last_heading(heading: float, speed: float) -> None:
    actor = arriving(heading, speed)
    (end,) = actor.walk_ends_s
    assert end <= 0.2 + DISTANCE_M / speed + SETTLE_S + 1e-3
    stands = actor.moment(end + 1e-6)
    assert np.allclose(stands.place, to_world(PLACE))
    assert abs(wrap_deg(stands.azimuth_deg - wrap_deg(heading - 180))) < 1e-3


@pytest.mark.parametrize("heading", [180, 130, -130])
def test_the_arm_stands_on_the_poi_from_the_begin_of_the_stroke(heading: float) -> None:
    actor = arriving(heading)
    target, begin_s = to_world((2.0, 2.5, 1.0)), 0.2 + DISTANCE_M / 1.1 + SETTLE_S + 0.41
    moments = [actor.moment(begin_s + since) for since in np.arange(0.0, 1.15, 0.1)]
    assert {moment.phase for moment in moments} == {"stroke"}
    for moment in moments:
        shoulder = moment.shoulder["left"]
        arm, way = moment.fingertip["left"] - shoulder, target - shoulder
        assert math.degrees(math.acos(arm @ way / np.linalg.norm(arm) / np.linalg.norm(way))) < 14


@pytest.mark.parametrize("seed", range(4))
def test_nothing_jumps_where_a_walk_begins_and_ends(seed: int) -> None:
    actor = arriving(100, restlessness=1.0, seed=seed)
    for time in (0.2, actor.walk_ends_s[0]):
        before, after = actor.moment(time - 1e-4), actor.moment(time + 1e-4)
        assert np.linalg.norm(after.skeleton.positions - before.skeleton.positions, axis=1).max() < 1.5e-3
