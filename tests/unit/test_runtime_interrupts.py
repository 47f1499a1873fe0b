"""Signals set a flag and nothing else, so that no handler can wait for what it interrupted."""

import os
import signal
import threading
import time

import pytest
from deixis_runtime.interrupts import Interrupts


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_noted_and_ends_a_wait_soon(number):
    with Interrupts() as noted:
        threading.Timer(0.1, os.kill, (os.getpid(), number)).start()
        began_s = time.monotonic()
        assert noted.wait(5.0)
        assert time.monotonic() - began_s < 1.0
    assert noted.signal == number


def test_a_wait_without_a_signal_takes_its_time():
    with Interrupts() as noted:
        began_s = time.monotonic()
        assert not noted.wait(0.25)
        assert time.monotonic() - began_s >= 0.25


def test_handlers_are_put_back():
    before = signal.getsignal(signal.SIGTERM)
    with Interrupts():
        assert signal.getsignal(signal.SIGTERM) != before
    assert signal.getsignal(signal.SIGTERM) == before
