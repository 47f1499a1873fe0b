"""A message that repeats is said once per period, with the number left out."""

from deixis_runtime.limit import RateLimit


def test_repeats_are_counted_and_said_later():
    limit = RateLimit(period_s=10)
    assert limit.allow("a", 0.0) == 0
    assert [limit.allow("a", t) for t in (1.0, 2.0, 9.9)] == [None] * 3
    assert limit.allow("a", 10.0) == 3
    assert limit.allow("b", 10.0) == 0


def test_memory_is_bounded():
    limit = RateLimit(period_s=10, max_kinds=3)
    for number in range(100):
        assert limit.allow(str(number), 0.0) == 0
    assert len(limit._said) <= 3
