"""How far another host's clock is ahead of ours, by questions and answers over a link of whatever delays."""

import pytest
from deixis_runtime.clock_offset import DRIFT, ClockOffset, Exchange, Offset, estimate
from deixis_runtime.clock_watch import say_skew
from hypothesis import given
from hypothesis import strategies as st

S = 10**9
AHEAD_NS = st.integers(-40 * 365 * 86_400 * S, 40 * 365 * 86_400 * S)
WAY_NS = st.integers(0, 3 * S)
PAUSE_NS = st.integers(1, 3 * S)
EXCHANGES = st.lists(st.tuples(PAUSE_NS, WAY_NS, WAY_NS), min_size=1, max_size=40)


def play(offset, exchanges, ahead_ns, now_ns=10**15, drift=0.0):
    """Exchanges one after the other: a pause, the way there and the way back of each. Returns our time at the end."""
    began_ns = now_ns
    for pause_ns, there_ns, back_ns in exchanges:
        asked_ns = now_ns + pause_ns
        at_ns = asked_ns + there_ns
        now_ns = at_ns + back_ns
        offset.note(Exchange(asked_ns, at_ns + ahead_ns + round(drift * (at_ns - began_ns)), now_ns))
    return now_ns


@given(AHEAD_NS, EXCHANGES)
def test_the_error_is_at_most_half_the_quickest_round_trip_whatever_the_ways_are(ahead_ns, exchanges):
    offset = ClockOffset()
    now_ns = play(offset, exchanges, ahead_ns)
    known = offset.at(now_ns)
    assert abs(known.ahead_ns - ahead_ns) <= known.uncertain_ns
    assert offset.steps == 0
    last = exchanges[-1]
    round_trip_ns = last[1] + last[2]
    assert known.uncertain_ns <= round_trip_ns / 2 + round_trip_ns * DRIFT + 2


@given(AHEAD_NS, EXCHANGES, st.floats(-DRIFT / 2, DRIFT / 2))
def test_a_clock_that_drifts_stays_within_what_is_said_and_is_not_taken_to_be_set(ahead_ns, exchanges, drift):
    offset = ClockOffset()
    began_ns = 10**15
    now_ns = play(offset, exchanges, ahead_ns, began_ns, drift)
    known = offset.at(now_ns)
    true_ns = ahead_ns + round(drift * (now_ns - began_ns))
    assert abs(known.ahead_ns - true_ns) <= known.uncertain_ns + 2
    assert offset.steps == 0


@given(AHEAD_NS, st.lists(st.tuples(PAUSE_NS, st.just(4 * S), WAY_NS), max_size=14), st.permutations(range(5)))
def test_slow_exchanges_do_not_spoil_a_quick_one(ahead_ns, slow, order):
    exchanges = [*slow, (S, 1_000_000, 3_000_000)]
    exchanges.insert(order[0] % len(exchanges), (S, 2 * S, 0))
    offset = ClockOffset()
    known = offset.at(play(offset, exchanges, ahead_ns))
    assert abs(known.ahead_ns - ahead_ns) <= known.uncertain_ns < 30_000_000


@given(AHEAD_NS, EXCHANGES, EXCHANGES, st.one_of(st.integers(7 * S, 10**4 * S), st.integers(-(10**4) * S, -7 * S)))
def test_a_clock_that_is_set_is_followed_with_the_next_exchange(ahead_ns, before, after, step_ns):
    offset = ClockOffset()
    now_ns = play(offset, before, ahead_ns)
    now_ns = play(offset, after, ahead_ns + step_ns, now_ns)
    known = offset.at(now_ns)
    assert abs(known.ahead_ns - ahead_ns - step_ns) <= known.uncertain_ns
    assert offset.steps == 1


def test_what_is_a_minute_old_is_not_known_any_more():
    offset = ClockOffset()
    now_ns = play(offset, [(1, 1000, 1000)], 5 * S)
    assert offset.at(now_ns + 59 * S).ahead_ns == 5 * S
    assert offset.at(now_ns + 61 * S) is None
    offset.forget()
    assert offset.at(now_ns) is None


def test_clocks_that_may_well_be_equal_are_not_corrected_and_not_complained_of():
    assert Offset(900, 1000).correction_ns == 0
    assert Offset(-5000, 1000).correction_ns == -5000
    assert (Offset(5000, 1000).surely_ns, Offset(-5000, 1000).surely_ns, Offset(500, 1000).surely_ns) == (4000, -4000, 0)
    assert say_skew("host 'robot'", Offset(2 * S, 18 * S // 10), "ours") is None


@pytest.mark.parametrize(
    ("ahead_s", "said"),
    [
        (0.41, "0.41 s ahead of"),
        (-7, "7.0 s behind"),
        (303, "5 min 3 s ahead of"),
        (-7200, "2 h 0 min behind"),
        (2e9, "23148 days ahead of"),
    ],
)
def test_a_skew_is_said_in_words(ahead_s, said):
    assert say_skew("host 'robot'", Offset(round(ahead_s * S), 1000), "ours") == f"the clock of host 'robot' is {said} ours"


def test_our_own_wall_clock_may_be_set_without_harm():
    known = estimate([Exchange(1000, 500_000, 3000)])
    assert known == Offset(498_000, 1001)
    assert known.beside(498_000) == Offset(0, 1001)
    assert known.beside(98_000) == Offset(400_000, 1001)
