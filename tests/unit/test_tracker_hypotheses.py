import numpy as np
import pytest
from deixis_tracker.hypotheses import best_tracks, cells_of, propagate, sample_pixels, support


def test_hypotheses_move_with_their_track_and_support_the_blob_they_reach():
    blob = np.ones((20, 20), np.uint8)
    pixels = sample_pixels(blob, 30, 40)
    density = propagate(pixels, 60, 0, 3.0, 120, 160)
    assert density.values.sum() == pytest.approx(1, abs=0.01)
    assert support(density, cells_of(blob, 90, 40)) > 0.6
    assert support(density, cells_of(blob, 30, 40)) < 0.01


def test_two_tracks_share_a_merged_blob_by_density():
    left = propagate(sample_pixels(np.ones((20, 20), np.uint8), 20, 20), 0, 0, 3.0, 80, 160)
    right = propagate(sample_pixels(np.ones((20, 20), np.uint8), 60, 20), 0, 0, 3.0, 80, 160)
    merged = np.ones((20, 60), np.uint8)
    best = np.argmax([density.at(cells_of(merged, 20, 20)) for density in (left, right)], axis=0).reshape(20, 60)
    assert (best[:, :20] == 0).all()
    assert (best[:, -20:] == 1).all()


@pytest.mark.parametrize("place", [(0, 0), (150, 110), (-30, 40), (400, 400)])
def test_a_density_is_none_where_no_hypothesis_is(place):
    density = propagate(sample_pixels(np.ones((20, 20), np.uint8), *place), 0, 0, 3.0, 120, 160)
    everywhere = cells_of(np.ones((124, 164), np.uint8), 0, 0)  # the last cells reach out of the picture
    values = density.at(everywhere).reshape(124, 164)
    assert values.sum() / 16 == pytest.approx(density.values.sum(), abs=1e-4)
    rows, columns = np.nonzero(values)
    assert all(abs(x - place[0] - 10) < 40 and abs(y - place[1] - 10) < 40 for x, y in zip(columns, rows, strict=True))
    assert support(density, cells_of(np.zeros((4, 4), np.uint8), 0, 0)) == 0


def test_a_track_claims_only_the_blob_that_holds_most_of_it():
    supports = np.array([[0.2, 0.7, 0.0], [0.1, 0.0, 0.05], [0.0, 0.3, 0.2]])
    assert best_tracks(supports, 0.15) == [[], [0, 2], []]
    assert best_tracks(np.zeros((2, 0)), 0.15) == []
