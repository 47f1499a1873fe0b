"""Puts that may block for seconds, as in lockstep behind a router that hangs: the loop goes on giving signs meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

TURN_S = 0.1


class PatientPuts:
    """Does one put after the other in a thread of its own, and waits for each."""

    def __init__(self, turn: Callable[[], bool]) -> None:
        """`turn` is called while a put lasts, several times a second; it says whether to go on waiting."""
        self._turn = turn
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="put")

    def do(self, put: Callable[[], None]) -> bool:
        """Do this put; whether it is done, or given up because the loop is to end. Raises what it raises."""
        future = self._executor.submit(put)
        while wait([future], TURN_S).not_done:
            if not self._turn():
                return False
        future.result()
        return True
