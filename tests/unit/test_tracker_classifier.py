import pytest
from deixis_tracker.classifier import Features, HandBelief, label


def watched(*features):
    belief = HandBelief()
    for feature in features:
        for _ in range(30):
            belief.update(feature, 1 / 30)
    return belief


HANGING_RIGHT = Features(-1.4, 4.0, 0.3, 0.3, 0.9, 0.9)
HANGING_LEFT = Features(1.4, 4.0, 0.3, 0.3, 0.9, 0.9)


def test_a_hand_hanging_at_the_right_of_the_picture_is_the_persons_left():
    assert watched(HANGING_LEFT).probabilities().left_hand > 0.9
    assert watched(HANGING_RIGHT).probabilities().right_hand > 0.9


def test_probabilities_sum_to_one():
    p = watched(HANGING_LEFT).probabilities()
    assert p.face + p.left_hand + p.right_hand + p.unknown == pytest.approx(1)


def test_an_arm_that_crosses_the_body_keeps_its_side():
    crossing = watched(HANGING_LEFT, Features(-1.8, 0.8, 0.1, 0.3, 1.0, 0.9))
    other = watched(HANGING_RIGHT)
    assert label([crossing, other], ["left_hand", "right_hand"]) == ["left_hand", "right_hand"]


def test_a_still_blob_without_foreground_is_unknown():
    assert label([watched(Features(-1.0, 1.0, 0.0, 0.02, 0.0, 0.6))], ["unknown"]) == ["unknown"]


def test_one_person_has_each_hand_once():
    kinds = label([watched(HANGING_LEFT), watched(HANGING_LEFT)], ["unknown", "unknown"])
    assert sorted(kinds) != ["left_hand", "left_hand"]


def test_a_raised_hand_wins_its_label_from_a_patch_that_is_barely_skin():
    hand = watched(Features(-3.0, 1.5, 0.1, 0.35, 1.0, 0.87))
    patch = watched(Features(-1.2, 4.5, 0.0, 0.15, 1.0, 0.6))
    assert label([patch, hand], ["unknown", "unknown"]) == ["unknown", "right_hand"]


def test_however_long_a_raised_hand_is_held_across_the_body_its_side_stays():
    held = watched(HANGING_LEFT, *[Features(-1.8, 0.8, 0.1, 0.3, 1.0, 0.9)] * 20)
    assert held.probabilities().left_hand > held.probabilities().right_hand
