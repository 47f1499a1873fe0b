"""What `deixis --help` and a mistyped command answer: the names of all commands, and a line on each.

The lines are read from the source of the commands, which is not run: to import all of them takes ten times as long as this.
"""

from __future__ import annotations

import argparse
import ast
from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path

GROUP = "deixis.commands"
DESCRIPTION = "Tells a robot which thing a person is pointing at."


def installed() -> list[EntryPoint]:
    """The subcommands that are installed here, by name."""
    return sorted(entry_points(group=GROUP), key=lambda entry: entry.name)


def is_enough(argv: Sequence[str]) -> bool:
    """Whether no command has to be known any better: none is given, or one that there is not."""
    return not argv or argv[0] not in {entry.name for entry in installed()}


def show(argv: Sequence[str]) -> None:
    """Answer with the overview, or say what is wrong with `argv`. Raises SystemExit, as argparse does."""
    top = argparse.ArgumentParser(prog="deixis", description=DESCRIPTION)
    subparsers = top.add_subparsers(metavar="COMMAND", required=True)
    for entry in installed():
        subparsers.add_parser(entry.name, help=line_on(entry))
    top.parse_args(argv)


def line_on(entry: EntryPoint) -> str:
    """What the command's module says in `add_parser(NAME, help=...)`; empty where that cannot be read there."""
    spec = find_spec(entry.module)
    if spec is None or spec.origin is None:
        return ""
    for node in ast.walk(ast.parse(Path(spec.origin).read_bytes())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "add_parser":
            name = node.args[0].value if node.args and isinstance(node.args[0], ast.Constant) else None
            texts = [word.value.value for word in node.keywords if word.arg == "help" and isinstance(word.value, ast.Constant)]
            if name == entry.name and texts:
                return str(texts[0])
    return ""
