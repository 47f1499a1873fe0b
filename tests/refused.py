"""Runs `deixis` in the test's own process: for what is refused before anything starts, without the start of a process."""

from __future__ import annotations

import pytest
from deixis_cli.main import main
from own_environment import own_environment


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    """Exit status and standard error of a command line; what it raises but that argparse ends it is raised here too."""
    capsys.readouterr()
    try:
        with own_environment():
            status = main([*map(str, arguments)])
    except SystemExit as error:
        status = error.code if isinstance(error.code, int) else 1
    return status, capsys.readouterr().err
