import numpy as np
import pytest
from deixis_tracker.background import Background, MotionHistory
from deixis_tracker.camera_motion import Shift
from deixis_tracker.frame import Box, Step


@pytest.fixture
def room():
    rng = np.random.default_rng(5)
    blocks = rng.integers(60, 200, (12, 16, 3)).astype(np.uint8)
    return np.kron(blocks, np.ones((10, 10, 1), np.uint8))


def frames(seconds, rate_hz=30):
    period_ns = round(1e9 / rate_hz)
    return [Step(k * period_ns, k * period_ns, period_ns) for k in range(1, round(seconds * rate_hz) + 1)]


def nobody(room):
    return np.zeros(room.shape[:2], np.uint8)


def test_a_change_of_light_is_no_change_of_the_room(room):
    background = Background(room, 20)
    assert background.changed((room * 0.6).astype(np.uint8), nobody(room)).mean() < 0.02 * 255


def test_a_person_standing_still_is_not_swallowed(room):
    background = Background(room, 20)
    seen = room.copy()
    seen[40:100, 60:90] = (20, 250, 20)
    people = nobody(room)
    people[30:120, 50:100] = 255
    for step in frames(20):
        changed = background.changed(seen, people)
        background.update(seen, changed, people, step)
    assert changed[40:100, 60:90].mean() > 0.95 * 255


def test_a_thing_put_into_the_room_is_learned_in_time(room):
    background = Background(room, 20)
    seen = room.copy()
    seen[40:60, 60:90] = (20, 250, 20)
    for step in frames(30):
        changed = background.changed(seen, nobody(room))
        background.update(seen, changed, nobody(room), step)
    assert not changed.any()


def test_a_shadow_is_removed_and_a_hand_is_not(room):
    background = Background(room, 20)
    seen = room.copy()
    seen[20:40, 20:40] = (room[20:40, 20:40] * 0.6).astype(np.uint8)
    seen[60:80, 60:80] = (90, 120, 190)
    changed = background.changed(seen, nobody(room))
    kept = background.remove_shadow(seen, changed)
    assert kept[20:40, 20:40].mean() < 0.05 * 255
    assert kept[60:80, 60:80].mean() > 0.8 * changed[60:80, 60:80].mean()


def test_where_a_person_stood_from_the_start_is_unknown(room):
    background = Background(room, 20)
    background.mark_unknown(Box(-10, 20, 30, 500))
    assert background.unknown[20:, :20].all()
    assert not background.unknown[:20].any()


@pytest.mark.parametrize("rate_hz", [10, 30, 60])
def test_a_thing_put_into_the_room_is_learned_as_fast_at_any_frame_rate(room, rate_hz):
    background = Background(room, 20)
    seen = room.copy()
    seen[40:60, 60:90] = (20, 250, 20)
    learned_s = None
    for step in frames(30, rate_hz):
        changed = background.changed(seen, nobody(room))
        background.update(seen, changed, nobody(room), step)
        learned_s = learned_s or (None if changed.any() else step.now_ns / 1e9)
    assert learned_s == pytest.approx(11.4, abs=0.4)


@pytest.mark.parametrize("rate_hz", [10, 30, 60])
def test_motion_is_remembered_for_half_a_second_at_any_frame_rate(room, rate_hz):
    motion = MotionHistory(room)
    moved = room.copy()
    moved[40:60, 60:90] = (20, 250, 20)
    remembered = 0
    for step in frames(1, rate_hz):
        motion.update(moved, Shift.none(), step)
        remembered += bool(motion.history.any())
    assert remembered / rate_hz == pytest.approx(0.53, abs=0.1)
