"""Which POIs a person sees, and at which bearings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from deixis_fusion.localisation import PersonPlace, bearing_deg
from deixis_fusion.sight import CASES, DISTANCE_ERRORS, Lookout, Points, Sight
from deixis_fusion.visibility import Candidate, Wall, Walls, sees
from deixis_schemas.messages import Poi
from hypothesis import given
from hypothesis import strategies as st

metres = st.floats(-5, 5)
WALL = ((1.0, -1.0), (1.0, 1.0))


def place(x: float, y: float, sigma_m: float = 0.1) -> PersonPlace:
    return PersonPlace((x, y, 1.6), (0, 0, 1.2), math.dist((x, y, 1.6), (0, 0, 1.2)), sigma_m)


def look(here: PersonPlace, *positions: tuple[float, float], extent_m: float = 0.0, walls: list[Wall] | None = None) -> Sight:
    pois = [Poi(poi_id=f"P{i}", position_m=(*xy, 1.0), extent_m=extent_m) for i, xy in enumerate(positions)]
    return Lookout(0.15).look(here, Points.of(pois), Walls(walls or []))


# --- walls ------------------------------------------------------------------------------------------------------------


def test_a_wall_hides_what_lies_behind_it() -> None:
    assert not sees((0, 0), (2, 0), [WALL])
    assert sees((0, 0), (2, 3), [WALL])
    assert sees((2, 1), (3, 0), [WALL])


def test_a_poi_that_hangs_on_a_wall_is_seen() -> None:
    assert sees((0, 0), (1.0, 0.2), [WALL])
    assert sees((0, 0), (1.1, 0.0), [WALL])


def test_a_ray_through_the_corner_of_two_walls_is_blocked() -> None:
    assert not sees((0, 0), (2, 2), [((1, 1), (1, 3)), ((1, 1), (3, 1))])


def test_a_wall_seen_from_its_end_hides_what_lies_beyond_it() -> None:
    assert not sees((0, 0), (4, 0), [((1, 0), (2, 0))])
    assert sees((0, 0), (-4, 0), [((1, 0), (2, 0))])


@given(metres, metres, metres, metres)
def test_sight_is_mutual(ax: float, ay: float, bx: float, by: float) -> None:
    assert sees((ax, ay), (bx, by), [WALL], 0.0) == sees((bx, by), (ax, ay), [WALL], 0.0)


def test_an_exhibit_that_the_map_shows_as_occupied_does_not_hide_itself_but_what_is_behind_it() -> None:
    around = [((3.0, -0.3), (3.6, -0.3)), ((3.6, -0.3), (3.6, 0.3)), ((3.6, 0.3), (3.0, 0.3)), ((3.0, 0.3), (3.0, -0.3))]
    sight = look(place(1.0, 0.0), (3.3, 0.0), (4.5, 0.0), extent_m=0.7, walls=around)
    assert [candidate.poi.poi_id for candidate in sight] == ["P0"]
    partition = [((3.0, -2.0), (3.0, 2.0))]
    assert len(look(place(1.0, 0.0), (3.3, 0.0), extent_m=0.7, walls=partition)) == 0


def test_many_sight_lines_past_many_walls_are_those_of_a_plain_reckoning() -> None:
    rng = np.random.default_rng(2)
    points, first = rng.uniform(-9, 9, (400, 2)), rng.uniform(-9, 9, (60, 2))
    ends = np.stack([first, first + rng.uniform(-3, 3, (60, 2))], axis=1)
    walls = [((float(a), float(b)), (float(c), float(d))) for (a, b), (c, d) in ends]
    for eye in ((0.3, 0.2), (-7.0, 4.0), (30.0, 1.0)):
        hidden = Walls(walls).hide(eye, points, 0.15)
        plain = [any(_crosses(eye, point, wall) for wall in ends) for point in points]
        assert hidden.tolist() == plain
        assert 0 < sum(plain) < len(points)


def _crosses(eye: tuple[float, float], point: np.ndarray, wall: np.ndarray) -> bool:
    way = point - eye
    way = way * (1 - 0.15 / np.hypot(*way))
    matrix = np.array([way, wall[0] - wall[1]]).T
    along, across = np.linalg.solve(matrix, wall[0] - eye)
    return bool(0 <= along <= 1 and 0 <= across <= 1)


# --- bearings ---------------------------------------------------------------------------------------------------------


@given(metres, metres, metres, metres)
def test_the_likeliest_bearing_is_that_of_the_place(x: float, y: float, px: float, py: float) -> None:
    if math.hypot(x, y) < 0.1 or math.dist((x, y), (px, py)) < 0.1:
        return
    here = place(x, y)
    found = look(here, (px, py)).bearings.likeliest[0]
    off = (found - bearing_deg(here, (px, py, 1.0)) + 180) % 360 - 180
    assert off == pytest.approx(0, abs=1e-6)


def test_an_uncertain_distance_blurs_what_lies_to_the_side_and_not_what_lies_ahead() -> None:
    bearings = look(place(2, 0), (2, -1), (1, 0)).bearings
    assert bearings.sigma[0] == pytest.approx(math.degrees(math.atan(0.1)), rel=0.01)
    assert bearings.sigma[1] == pytest.approx(0, abs=1e-6)
    assert bearings.cases.std(axis=0) == pytest.approx(bearings.sigma, rel=0.05, abs=1e-6)


def test_in_a_case_all_pois_are_seen_from_one_place() -> None:
    here = place(3, 0, sigma_m=0.5)
    bearings = look(here, (3, -1), (3, -2), (2, 1)).bearings
    for case in (0, CASES - 1):
        distance = 3 * math.exp(0.5 / here.distance_m * DISTANCE_ERRORS[case])
        there = place(distance, 0)
        expected = [bearing_deg(there, (*xy, 1.0)) for xy in ((3, -1), (3, -2), (2, 1))]
        assert bearings.cases[case] == pytest.approx(expected, abs=1e-4)


def test_a_wide_poi_may_be_meant_anywhere_on_it() -> None:
    bearings = look(place(2, 0, sigma_m=0.0), (2, -3), extent_m=1.0).bearings
    half = math.degrees(math.atan(0.5 / 3))
    assert bearings.cases[:, 0].min() == pytest.approx(90 - half, abs=1.5)
    assert bearings.cases[:, 0].max() == pytest.approx(90 + half, abs=1.5)


def test_of_bare_candidates_the_sigma_is_taken_for_that_of_a_normal_distribution() -> None:
    sight = Sight.of([Candidate(Poi(poi_id="P", position_m=(0, 0, 0)), 40.0, 5.0)])
    assert sight.bearings.cases.mean() == pytest.approx(40)
    assert sight.bearings.cases.std() == pytest.approx(5)


# --- from frame to frame ----------------------------------------------------------------------------------------------


def test_the_frame_of_discernment_holds_the_visible_pois_in_their_order() -> None:
    sight = look(place(0.5, 0), (0, 2), (2.5, 0), (0, 1), walls=[WALL])
    assert [candidate.poi.poi_id for candidate in sight] == ["P0", "P2"]
    assert [candidate.poi.poi_id for candidate in sight[1:]] == ["P2"]


def test_sight_lines_are_kept_while_the_person_stands_still(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[tuple[float, float]] = []
    plain = Walls.hide
    monkeypatch.setattr(Walls, "hide", lambda self, eye, *rest: looked.append(eye) or plain(self, eye, *rest))
    lookout, points, walls = Lookout(0.15), Points.of([Poi(poi_id="P", position_m=(1, 2, 1))]), Walls([WALL])
    for x in (2.0, 2.005, 1.995, 2.05):
        lookout.look(place(x, 0), points, walls)
    assert [eye[0] for eye in looked] == [2.0, 2.05]
    lookout.look(place(2.05, 0), Points.of(points.pois), walls)
    lookout.look(place(2.05, 0), points, Walls([]))
    assert len(looked) == 4
