"""Puts that block, and the loop that goes on meanwhile."""

import threading
import time

import pytest
from deixis_runtime.patient_puts import PatientPuts


def test_the_loop_has_its_turns_while_a_put_blocks():
    turns, gate = [], threading.Event()

    def turn():
        turns.append(time.monotonic())
        if len(turns) == 3:
            gate.set()
        return True

    assert PatientPuts(turn).do(lambda: gate.wait(10))
    assert len(turns) >= 3
    assert gate.is_set()


def test_a_put_that_is_done_at_once_costs_no_turn():
    turns = []
    assert PatientPuts(lambda: not turns.append(1)).do(lambda: None)
    assert turns == []


def test_a_loop_that_is_told_to_stop_does_not_wait_for_a_put():
    gate = threading.Event()
    began_s = time.monotonic()
    assert not PatientPuts(lambda: False).do(lambda: gate.wait(10))
    assert time.monotonic() - began_s < 5
    gate.set()


def test_what_a_put_raises_is_raised():
    def put():
        raise ValueError("closed")

    with pytest.raises(ValueError, match="closed"):
        PatientPuts(lambda: True).do(put)
