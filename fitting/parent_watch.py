"""Ends a process that makes data for fitting once the one that asked for them is gone."""

from __future__ import annotations

import os
import threading
from multiprocessing import parent_process


def end_with_parent() -> None:
    """From now on, end this process when its parent is gone, whatever it waits for.

    A parent that is killed hard cannot end it, and its queue, full and read by nobody, would hold it for ever.
    """
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="parent-watch").start()
