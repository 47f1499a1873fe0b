"""Rerun, where it is installed: it is large, and so an extra."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from deixis_cli.options import CommandError

if TYPE_CHECKING:
    from .rerun_sink import RerunSink

SUFFIX = ".rrd"
MISSING = (
    "Rerun, which draws, is not installed here; 'make rerun' does it, or pip install 'deixis-view[rerun]' (660 MB on disk)"
)


class SinkError(OSError):
    """What is drawn cannot be kept; the text names the file."""


def check_installed() -> None:
    """Raises CommandError where Rerun is not installed."""
    if find_spec("rerun") is None:
        raise CommandError(MISSING)


def leave_viewer_to_us() -> None:
    """Have the library say nothing of a viewer that is gone, which we say: it does so several times over. Before any sink."""
    os.environ.setdefault("RUST_LOG", "warn,re_grpc_client=off,re_sdk::recording_stream=off")


def new_sink(name: str, *, live: bool) -> RerunSink:
    """A sink whose recording has this name. live: it leaves out what a viewer does not take at once.

    Raises CommandError where Rerun is not installed.
    """
    check_installed()
    from .rerun_sink import RerunSink  # noqa: PLC0415 - it takes a second, and is not there everywhere

    return RerunSink(name=name, live=live)


def sink_for_file(path: Path, *, name: str) -> RerunSink:
    """A sink to a file, which takes the place of one that is there when it is closed.

    Raises CommandError where that cannot be, or where the name says another kind.
    """
    if path.suffix != SUFFIX:
        raise CommandError(f"'{path}': what is drawn goes to a file of Rerun's, whose name ends in {SUFFIX}")
    sink = new_sink(name, live=False)
    try:
        return sink.to_file(path)
    except SinkError as error:
        raise CommandError(str(error)) from None
