import numpy as np
from deixis_simulation.portrait_cameras import camera_bearing, camera_elevation_deg


def test_a_camera_that_shall_see_the_hand_at_the_face_stands_about_where_it_points() -> None:
    rng = np.random.default_rng(0)
    seen = np.array([camera_bearing(rng, np.array([40.0, -10.0])) for _ in range(200)])
    assert np.abs(seen.mean(axis=0) - (40, -10)).max() < 4


def test_cameras_look_up_at_heads_more_often_than_down() -> None:
    rng = np.random.default_rng(0)
    elevations = np.array([camera_elevation_deg(rng) for _ in range(4000)])
    below, above = np.mean(elevations < -25), np.mean(elevations > 25)
    assert below > above > 0.04
    assert np.abs(elevations).max() <= 40
