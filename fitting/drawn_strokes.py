"""Strokes made up: POIs around a person who means one of them, and what is seen of hand and head. No clip is looked at.

By our own model (`curves.py`), or by a worse one, as real people and unseen places are: angles are half as far off again as is
stated, distances too, hands are nonsense twice as often, and heads look elsewhere more.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from deixis_fusion.config import FusionConfig
from deixis_fusion.evidence import Evidence, HandObservation, HeadObservation, Witness
from deixis_fusion.localisation import PersonPlace, bearing_deg, wrapped_deg
from deixis_fusion.pointing import PointingGesture
from deixis_fusion.sight import Lookout, Points, Sight
from deixis_fusion.visibility import Walls
from deixis_schemas.messages import Poi

SAID = Witness("ok", "")
HAND_SIGMAS_DEG, YAW_SIGMAS_DEG = (8.0, 30.0), (2.0, 6.0)
DISTANCES_M, ROOM_M, NEAREST_M = (1.2, 4.0), 5.0, 0.8


class World(NamedTuple):
    """How much worse the world is than what fusion is told of it. `elsewhere`: heads that look at another POI, or anywhere."""

    errors: float
    hand_outlier: float
    at_robot: float
    elsewhere: float

    @staticmethod
    def own(config: FusionConfig) -> World:
        """As fusion's own model has it."""
        return World(1.0, config.hand.outlier, config.head.at_robot, config.head.outlier)

    @staticmethod
    def worse(config: FusionConfig) -> World:
        """As it may be."""
        return World(1.5, 2 * config.hand.outlier, config.head.at_robot + 0.05, 0.15)


class Stroke(NamedTuple):
    """What fusion is given of one stroke, and which POI in sight was meant (none where it is not among them)."""

    seen: Sight
    evidence: Evidence
    meant: int | None


def draw(number: int, world: World, config: FusionConfig, rng: np.random.Generator, away: bool = False) -> Stroke:
    """A stroke with so many POIs in sight. `away`: what is meant is none of them."""
    distance = float(rng.uniform(*DISTANCES_M))
    true = _place(distance, 0.0)
    sigma = config.place.distance_sigma
    told = _place(distance * math.exp(float(rng.normal(0, sigma * world.errors))), sigma)
    spots = [_spot(distance, rng) for _ in range(number + 1)]
    pois = [Poi(poi_id=f"P{i}", position_m=(*spot, 1.2), extent_m=0.3) for i, spot in enumerate(spots)]
    bearings = [bearing_deg(true, poi.position_m) for poi in pois]
    shown, meant = pois[:number], number if away else int(rng.integers(number))
    other = bearings[int(rng.integers(number))]
    hand, head = _hand(bearings[meant], world, config, rng), _head(bearings[meant], other, world, config, rng)
    sight = Lookout(0.15).look(told, Points.of(shown), Walls(()))
    return Stroke(sight, Evidence(hand, SAID, head, SAID), None if away else meant)


def _place(distance: float, sigma: float) -> PersonPlace:
    return PersonPlace((distance, 0.0, 1.5), (0.0, 0.0, 1.5), distance, distance * sigma)


def _spot(distance: float, rng: np.random.Generator) -> tuple[float, float]:
    """A place in a square room around the person."""
    while True:
        x, y = (float(value) for value in rng.uniform(-ROOM_M, ROOM_M, 2))
        if math.hypot(x, y) > NEAREST_M:
            return distance + x, y


def _hand(bearing: float, world: World, config: FusionConfig, rng: np.random.Generator) -> HandObservation:
    beside = config.hand.min_deg < abs(bearing) < config.hand.max_deg
    gesture: PointingGesture = "point_left" if bearing > 0 else "point_right"
    if rng.random() < (config.hand.miss if beside else 0.9):
        gesture = "invisible"
    sigma = float(rng.uniform(*HAND_SIGMAS_DEG))
    off = float(rng.uniform(-180, 180)) if rng.random() < world.hand_outlier else float(rng.normal(0, sigma * world.errors))
    return HandObservation(gesture, wrapped_deg(bearing + off), sigma)


def _head(bearing: float, other: float, world: World, config: FusionConfig, rng: np.random.Generator) -> HeadObservation:
    head, sigma = config.head, float(rng.uniform(*YAW_SIGMAS_DEG))
    looks = rng.random()
    if looks < world.at_robot:
        yaw = float(rng.normal(0, 8))
    elif looks < world.at_robot + world.elsewhere:
        yaw = other if rng.random() < 0.5 else float(rng.uniform(-100, 100))
    else:
        gain = 1.0 if rng.random() < head.full_turn else float(rng.uniform(head.gain_min, head.gain_max))
        yaw = gain * bearing + float(rng.normal(0, head.sigma_deg))
    yaw += float(rng.normal(0, sigma * world.errors))
    if abs(yaw) > head.range_deg:
        return HeadObservation(None, None, "left" if yaw > 0 else "right")
    return HeadObservation(yaw, sigma)
