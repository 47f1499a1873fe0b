"""The frames of a stroke as arrays that grow: what is kept from frame to frame says the same as reckoning all anew."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from deixis_fusion.evidence import ROW, Sample
from deixis_fusion.frames import EARLY_WEIGHT, FrameLog, Frames, Values
from deixis_fusion.hand_evidence import mean_curve
from deixis_fusion.localisation import PersonPlace, wrapped_deg
from deixis_fusion.robust import medians, middles_of, weigh
from deixis_fusion.shown import shown_over
from deixis_fusion.views import parts_of, views_of
from deixis_fusion.walk import APART_M, FARTHER, MOST_VIEWS, Walk
from deixis_schemas.messages import BEARING_STEP_DEG, BEARINGS, Gesture, HeadPose
from hypothesis import given, settings
from hypothesis import strategies as st

SETTLE_S = 0.2
numbers = st.one_of(st.floats(-50, 50), st.integers(-3, 3).map(float), st.just(math.nan))
counted = st.lists(st.tuples(numbers, numbers), min_size=1, max_size=40)
spots = st.lists(st.builds(complex, st.floats(-3, 3), st.floats(-3, 3)), max_size=120)


def plain_median(values: Values, weights: Values) -> float:
    """The value at which the weights of those up to it reach half of all."""
    known = ~np.isnan(values)
    if not known.any():
        return math.nan
    order = np.argsort(values[known], kind="stable")
    reached = weights[known][order].cumsum()
    return float(values[known][order][np.searchsorted(reached, reached[-1] * (0.5 - 1e-9))])


def early_weights(count: int, early: int) -> Values:
    return np.where(np.arange(count) < early, EARLY_WEIGHT, 1.0)


@given(counted, st.integers(0, 12))
def test_medians_of_many_rows_are_the_medians_of_each(rows: list[tuple[float, float]], early: int) -> None:
    values = np.array(rows).T
    weights = early_weights(len(rows), early)
    assert medians(values, early) == pytest.approx([plain_median(row, weights) for row in values], nan_ok=True)


@given(st.lists(st.floats(-80, 80), min_size=1, max_size=30), st.floats(-180, 180), st.integers(0, 6))
def test_a_direction_turns_with_what_was_measured(angles: list[float], turn: float, early: int) -> None:
    here, there = (
        middles_of(np.array([[wrapped_deg(angle + by) for angle in angles], *[[1.0] * len(angles)] * 3]), early)[0]
        for by in (0.0, turn)
    )
    assert here.direction_deg is not None
    assert there.direction_deg is not None
    assert wrapped_deg(there.direction_deg - here.direction_deg - turn) == pytest.approx(0, abs=1e-9)
    assert there.sigma_deg == pytest.approx(here.sigma_deg)


@given(spots)
def test_a_walk_that_grows_has_the_parts_that_one_looked_at_as_a_whole_has(walked: list[complex]) -> None:
    walk = Walk()
    for spot in walked:
        walk.add(spot)
    assert walk.starts == plain_starts(walked)


def plain_starts(walked: list[complex]) -> list[int]:
    apart_m = APART_M
    while True:
        starts: list[int] = []
        for i, spot in enumerate(walked):
            if not starts or abs(spot - walked[starts[-1]]) > apart_m:
                starts.append(i)
        if len(starts) <= MOST_VIEWS:
            return starts
        apart_m *= FARTHER


@settings(max_examples=25)
@given(st.lists(st.floats(-400, 400), min_size=1, max_size=12), st.randoms(use_true_random=False))
def test_a_mean_curve_is_the_mean_of_curves_each_turned_on_its_own(turns: list[float], dice: Any) -> None:
    curves = np.array([[dice.random() for _ in range(BEARINGS)] for _ in turns])
    weights = np.array([dice.choice([0.0, EARLY_WEIGHT, 1.0]) for _ in turns[1:]] + [1.0])
    at = np.arange(BEARINGS) * BEARING_STEP_DEG
    turned = [np.interp(at - round(by), at, curve, period=360) for by, curve in zip(turns, curves, strict=True)]
    expected = np.average(turned, axis=0, weights=weights)
    assert mean_curve(weights, curves, np.array(turns)) == pytest.approx(expected, abs=1e-12)


# --- strokes ----------------------------------------------------------------------------------------------------------


def walked(dice: np.random.Generator, count: int) -> list[Sample]:
    """Somebody who walks around a camera and points, with gaps in all that is told."""
    return [_sample(dice, i) for i in range(count)]


def _sample(dice: np.random.Generator, i: int) -> Sample:
    bearing = wrapped_deg(float(dice.normal(170, 12)))
    told: dict[str, Any] = {
        "person_id": 1,
        "phase": "stroke",
        "gesture": dice.choice(["point_left", "point_left", "invisible"]),
    }
    if dice.random() < 0.9:
        told |= {"bearing_deg": bearing, "bearing_sigma_deg": float(dice.uniform(5, 9)), "hand": "left"}
        told |= {"bearing_likelihood": dice.random(BEARINGS).tolist()}
    if dice.random() < 0.7:
        told |= {"elevation_deg": float(dice.normal(0, 5)), "elevation_sigma_deg": 4.0}
    pose = None
    if dice.random() < 0.9:
        pose = HeadPose(person_id=1, status="tracking", yaw_deg=float(dice.normal(40, 5)), yaw_sigma_deg=3.0)
    way = 0.01 * i
    position = (2 * math.cos(way) + 0.02 * i, 2 * math.sin(way), 1.6)
    place = PersonPlace(position, (0.0, 0.0, 1.2), 2.0, 0.2) if dice.random() < 0.9 else None
    return Sample(i * 33_000_000, i * 33_000_000, Gesture.model_validate(told), pose, place)


@pytest.mark.parametrize("seed", range(6))
def test_a_stroke_that_grew_frame_by_frame_shows_what_its_frames_show_anew(seed: int) -> None:
    samples, log = walked(np.random.default_rng(seed), 130), FrameLog()
    for i, sample in enumerate(samples):
        log.append(sample)
        if i % 9 == 0:
            everything(log)
    assert everything(log) == everything(samples)


@pytest.mark.parametrize("seed", range(3))
def test_a_stroke_whose_first_frames_are_forgotten_is_one_of_the_others(seed: int) -> None:
    samples = walked(np.random.default_rng(seed), 90)
    rest = FrameLog(samples).since(samples[30].at_ns)
    assert list(rest) == samples[30:]
    rest.append(samples[0])
    anew = everything([*samples[30:], samples[0]])
    assert everything(rest) == anew


def everything(samples: Any) -> Any:
    frames = weigh(samples, SETTLE_S)
    place = next(sample.place for sample in reversed(samples) if sample.place is not None)
    whole, parts = shown_over(frames, place.axis_deg), parts_of(frames)
    return rounded([whole, views_of(parts, *whole), [part.weight for part in parts]])


def rounded(told: Any) -> Any:
    """Numbers as far as sums in another order leave them."""
    if isinstance(told, float):
        return round(told, 9)
    if isinstance(told, (list, tuple)):
        return [rounded(one) for one in told]
    return [rounded(one) for one in vars(told).values()] if hasattr(told, "__dict__") else told


def test_directions_to_the_camera_go_on_from_each_other_where_the_circle_is_cut() -> None:
    camera = (0.0, 0.0, 1.2)
    places = [PersonPlace((2.0, 0.05 * i - 0.2, 1.6), camera, 2.0, 0.2) for i in range(9)]
    frames = Frames.of([Sample(i, i, None, None, place) for i, place in enumerate(places)])
    assert np.abs(np.diff(frames.column("axis_deg"))).max() < 2
    turns = frames.turns_to(places[-1].axis_deg)
    assert turns[-1] == 0
    for (one, turn), (other, next_turn) in pairwise(zip(places, turns, strict=True)):
        assert next_turn - turn == pytest.approx(wrapped_deg(other.axis_deg - one.axis_deg))


def test_of_a_frame_it_is_known_what_it_shows_and_what_it_does_not() -> None:
    frames = Frames.of([Sample(5, 5, None, None)])
    assert frames.totals()["frame"] == 1
    assert sum(frames.totals().values()) == 1
    assert np.isnan(frames.table[ROW["bearing_deg"] : ROW["at_ns"], 0]).all()


@pytest.mark.parametrize("seed", range(40))
def test_as_many_frames_for_either_are_a_tie_whatever_rounding_makes_of_their_sums(seed: int) -> None:
    dice = np.random.default_rng(seed)
    early, late = 2 * int(dice.integers(0, 8)), 2 * int(dice.integers(1, 90))
    seen = [HeadPose(person_id=1, status="tracking", yaw_deg=20, yaw_sigma_deg=3), HeadPose(person_id=1, status="out_of_range")]
    sides = [Gesture(person_id=1, phase="stroke", gesture=kind, hand="left") for kind in ("point_left", "point_right")]
    halves = np.concatenate([dice.permutation(np.arange(count) % 2) for count in (early, late)])
    samples = [Sample(i, i, sides[half], seen[half]) for i, half in enumerate(halves)]
    hand, head = shown_over(Frames.of(samples, early))
    assert hand is not None
    assert hand.gesture == "point_left"
    assert head is not None
    assert head.yaw_deg == 20
