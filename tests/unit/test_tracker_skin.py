import numpy as np
from deixis_tracker.skin import SkinModel, colour_table, hysteresis, look_up


def patch(*bgr):
    return np.full((24, 24, 3), bgr, np.uint8)


def test_skin_of_any_tone_is_likelier_than_a_blue_wall():
    model = SkinModel(0.2)
    for tone in ((140, 165, 215), (90, 120, 180), (45, 60, 95)):
        assert model.probability(patch(*tone)).mean() > model.probability(patch(200, 150, 110)).mean() + 60


def test_adapting_to_a_face_raises_its_colour():
    model = SkinModel(0.2)
    tone = patch(52, 62, 84)
    before = model.probability(tone).mean()
    rng = np.random.default_rng(3)
    model.adapt_person(0, (tone.reshape(-1, 3) + rng.integers(-5, 6, (576, 3))).astype(np.uint8), 1.0)
    assert model.probability(tone).mean() > before


def test_a_shirt_that_is_nearly_skin_is_learned_as_no_skin_and_forgotten_with_its_person():
    model = SkinModel(0.2)
    shirt = patch(80, 95, 120)
    before = model.probability(shirt).mean()
    model.adapt_clothes(0, shirt)
    assert model.probability(shirt).mean() < before - 20
    model.adapt_person(0, shirt.reshape(-1, 3), 1.0)
    model.forget_person(0)
    assert model.probability(shirt).mean() == before


def test_too_few_pixels_change_nothing():
    model = SkinModel(0.2)
    before = model.probability(patch(90, 120, 180))
    model.adapt_person(0, np.zeros((5, 3), np.uint8), 1.0)
    model.adapt_clothes(0, np.zeros((0, 4, 3), np.uint8))
    assert np.array_equal(before, model.probability(patch(90, 120, 180)))


def test_a_table_is_read_at_blue_green_red():
    table = np.zeros((32, 32, 32), np.uint8)
    table[1, 2, 3] = 77
    image = np.array([[[8, 16, 24], [24, 16, 8]]], np.uint8)
    assert look_up(colour_table(table), image).tolist() == [[77, 0]]


def test_hysteresis_keeps_weak_pixels_only_with_a_strong_one():
    probability = np.zeros((20, 40), np.uint8)
    probability[2:10, 2:10] = 100
    probability[5, 5] = 200
    probability[2:10, 20:30] = 100
    labels, stats, kept = hysteresis(probability, 70, 150, 10)
    assert len(kept) == 1
    assert labels[5, 5] == kept[0]
    assert stats[kept[0]][4] == 64
