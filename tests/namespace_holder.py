"""A process that keeps namespaces alive for as long as others are started in them."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from typing import Self


class NamespaceHolder:
    """Use as a context manager. argv: makes the namespaces, prints `up` in them and sleeps; what: they are called in errors."""

    def __init__(self, argv: Sequence[str], what: str) -> None:
        self._argv, self._what = argv, what
        self._holder: subprocess.Popen[str]

    @property
    def pid(self) -> int:
        """For nsenter."""
        return self._holder.pid

    def __enter__(self) -> Self:
        self._holder = subprocess.Popen(self._argv, stdout=subprocess.PIPE, text=True)
        assert self._holder.stdout is not None
        if self._holder.stdout.readline().strip() != "up":
            self.__exit__()
            raise RuntimeError(f"{self._what} cannot be made")
        return self

    def __exit__(self, *_: object) -> None:
        self._holder.kill()
        self._holder.wait()
        assert self._holder.stdout is not None
        self._holder.stdout.close()
