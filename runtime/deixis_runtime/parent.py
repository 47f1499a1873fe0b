"""Whether the process that started us is still there: who was started by a supervisor ends with it, killed or not."""

from __future__ import annotations

import os
from collections.abc import Mapping

SUPERVISED_BY = "DEIXIS_SUPERVISED_BY"
"""Environment variable by which a supervisor tells its children its process number."""


class Parent:
    """The parent as the environment names it. Without a name it is the one that we have now, which may be another already."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        named = environment.get(SUPERVISED_BY, "")
        self._pid = int(named) if named.isdigit() else os.getppid()

    def gone(self) -> bool:
        """Whether it has ended; the kernel gives its children another parent at once."""
        return os.getppid() != self._pid
