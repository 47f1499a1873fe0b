"""The `deixis` command. Subcommands are entry points of the group `deixis.commands`: `register(subparsers)`."""

from __future__ import annotations

import argparse
import sys

from deixis_runtime.host import HostFailed
from deixis_runtime.session import Unreachable, exit_now
from deixis_runtime.stage import setup_logging

from . import overview
from .options import CommandError
from .own_output import keep_output_to_ourselves


def parser(wanted: str | None = None) -> argparse.ArgumentParser:
    """The command line with all subcommands that are installed here; with the `wanted` one alone where it is one of them."""
    top = argparse.ArgumentParser(prog="deixis", description=overview.DESCRIPTION)
    subparsers = top.add_subparsers(metavar="COMMAND", required=True)
    installed = overview.installed()
    for entry in [entry for entry in installed if entry.name == wanted] or installed:
        try:
            entry.load()(subparsers)
        except ImportError as error:  # a command that cannot be loaded is no reason to lose the others
            print(f"deixis: the command '{entry.name}' is not available: {error}", file=sys.stderr)
    return top


def main(argv: list[str] | None = None) -> int:
    """Run one command. Exit status 0 when it did its job; 1 with the cause on standard error; 2: bad usage; 130: Ctrl-C."""
    argv = sys.argv[1:] if argv is None else argv
    try:
        # Within: a command's imports take seconds on a busy machine, and Ctrl-C in them deserves no traceback.
        given = parser(argv[0] if argv else None).parse_args(argv)
        setup_logging()
        return int(given.run(given))
    except (CommandError, HostFailed, Unreachable) as error:
        print(f"deixis: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def command() -> None:
    """What the console script (`entry`) runs: leaves at once when it is done, whatever threads a cut session has left."""
    keep_output_to_ourselves()
    try:
        status = main()
    except SystemExit as error:  # argparse: help or bad usage
        status = error.code if isinstance(error.code, int) else 1
    except BrokenPipeError:  # `deixis watch | head`
        status = 1
    exit_now(status)
