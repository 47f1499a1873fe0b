import cv2
import numpy as np
import pytest
from deixis_tracker.config import TrackerConfig
from deixis_tracker.finder import RIGHT_HAND, STRIDE, Finder, Surroundings
from deixis_tracker.frame import Step, Views, coarsened
from deixis_tracker.head_search import DISTURBED_S, Candidate, HeadSearch, _sways
from deixis_tracker.heads import HeadColours
from deixis_tracker.hypotheses import sample_pixels
from deixis_tracker.kalman import PointFilter
from deixis_tracker.persons import HandTrack, Person

PERIOD_NS = 33_333_333
FRAMES = 8


def view(sway_px):
    """Something dark of a head's size at (160, 120), so far aside."""
    rng = np.random.default_rng(1)
    picture = cv2.resize(rng.integers(140, 170, (24, 32, 3), np.uint8), (320, 240), interpolation=cv2.INTER_CUBIC)
    x = 160 + sway_px
    cv2.ellipse(picture, (round(16 * x), 16 * 120), (16 * 14, 16 * 19), 0, 0, 360, (40, 50, 70), -1, cv2.LINE_AA, 4)
    cv2.circle(picture, (round(16 * (x - 4)), 16 * 116), 16 * 3, (10, 10, 10), -1, cv2.LINE_AA, 4)
    coarse = coarsened(picture)
    nothing = np.zeros(coarse.shape[:2], np.uint8)
    return Views(picture, 1.0, picture, coarse, nothing, nothing)


def stands(near_somebody, mean_odds, shows_skin, sway_px):
    """Whether a candidate that was looked at in FRAMES pictures, and sways, is found to do so."""
    candidate = Candidate(160, 120, 30, 8.0, 0, looks=FRAMES, sum_of_odds=mean_odds * (FRAMES - 1), shows_skin=shows_skin)
    found = False
    for k in range(FRAMES):
        step = Step(10**10 + k * PERIOD_NS, k * PERIOD_NS, PERIOD_NS)
        if near_somebody:
            candidate.disturbed_ns = step.now_ns
        found |= _sways(candidate, view(sway_px * k / (FRAMES - 1)), step)
    return found


def test_who_stands_alone_and_sways_by_a_pixel_is_noticed():
    assert stands(near_somebody=False, mean_odds=1.2, shows_skin=False, sway_px=1.0)


@pytest.mark.parametrize(("mean_odds", "shows_skin", "noticed"), [(2.0, True, True), (1.2, True, False), (2.0, False, False)])
def test_a_slight_sway_counts_of_what_is_surely_a_head_and_shows_skin(mean_odds, shows_skin, noticed):
    assert stands(near_somebody=False, mean_odds=mean_odds, shows_skin=shows_skin, sway_px=0.25) is noticed


@pytest.mark.parametrize(("mean_odds", "shows_skin", "noticed"), [(2.0, True, True), (1.2, True, False), (2.0, False, False)])
def test_beside_somebody_known_only_what_is_surely_a_head_is_noticed(mean_odds, shows_skin, noticed):
    assert stands(near_somebody=True, mean_odds=mean_odds, shows_skin=shows_skin, sway_px=1.0) is noticed


def with_hand(hands, odds):
    person = Person(0, 0, PointFilter(160, 40, 1.0, 500.0), 40.0, HeadColours(), 0, 0, 0)
    pixels = sample_pixels(np.ones((20, 20), np.uint8), 150, 110)
    person.hands = [HandTrack(1, PointFilter(x, 120, 1.0, 500.0), pixels, None, 0, "left_hand") for x in hands]
    maps = np.full((4, 60, 80), -9.0, np.float32)
    maps[RIGHT_HAND, 120 // STRIDE, 160 // STRIDE] = odds
    person.around = Surroundings(maps, 0, 0, 1.0)
    return person


@pytest.mark.parametrize(
    ("hands", "odds", "is_hand"), [((170,), -9.0, True), ((), 2.0, True), ((250,), -9.0, False), ((), 0.2, False)]
)
def test_somebodys_hand_that_sways_is_no_head(hands, odds, is_hand):
    search = HeadSearch(240, 320, 1.0, TrackerConfig(), Finder())
    candidate = Candidate(160, 120, 30, 8.0, 0, looks=FRAMES, sum_of_odds=20.0, shows_skin=True)
    search.candidates.append(candidate)
    found = False
    for k in range(FRAMES):
        step = Step(10**10 + k * PERIOD_NS, k * PERIOD_NS, PERIOD_NS)
        search.disturb([with_hand(hands, odds)], False, step)
        found |= _sways(candidate, view(k / (FRAMES - 1)), step)
    assert found is not is_hand


def test_while_the_light_changes_nobody_is_noticed():
    candidate = Candidate(160, 120, 30, 8.0, 0, looks=FRAMES, sum_of_odds=20.0, shows_skin=True)
    for k in range(int(DISTURBED_S * 30)):
        step = Step(10**10 + k * PERIOD_NS, k * PERIOD_NS, PERIOD_NS)
        candidate.doubted_ns = 10**10
        assert not _sways(candidate, view(0.1 * k), step)


def test_a_new_place_is_looked_at_in_each_frame_and_an_old_one_ten_times_a_second():
    search = HeadSearch(240, 320, 1.0, TrackerConfig(), Finder())
    views, looks = view(0.0), []
    candidate = Candidate(160, 120, 30, 20.0, 0)
    search.candidates.append(candidate)
    for k in range(1, 31):
        step = Step(k * PERIOD_NS, k * PERIOD_NS, PERIOD_NS)
        candidate.odds, candidate.disturbed_ns = 20.0, step.now_ns
        search.confirmed(views, None, 1, step)  # type: ignore[arg-type]  # motion is not asked where it is disturbed
        looks.append(candidate.looks)
    assert looks[:3] == [2, 3, 4]
    assert looks[-1] == pytest.approx(4 + 9, abs=1)
