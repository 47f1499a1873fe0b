from deixis_headpose.uncertainty import yaw_sigma_deg
from hypothesis import given
from hypothesis import strategies as st


@given(yaw=st.floats(-100, 100), correlation=st.floats(0.5, 1), held=st.floats(0, 0.25))
def test_sigma_grows_with_the_turn_a_weak_match_and_holding(yaw: float, correlation: float, held: float) -> None:
    sigma = yaw_sigma_deg(yaw, correlation, held)
    assert sigma >= yaw_sigma_deg(yaw * 0.9, correlation, held)
    assert sigma <= yaw_sigma_deg(yaw, correlation - 0.1, held)
    assert sigma < yaw_sigma_deg(yaw, correlation, held + 0.1)


@given(yaw=st.floats(0, 100))
def test_sigma_is_the_same_to_both_sides(yaw: float) -> None:
    assert yaw_sigma_deg(yaw, 0.97, 0.0) == yaw_sigma_deg(-yaw, 0.97, 0.0)
