"""Writes docs/settings.md and docs/commands.md from the code, so that they say what it does: `make pages`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from deixis_camera.config import CameraConfig
from deixis_cli.main import parser
from deixis_fusion.config import FusionConfig
from deixis_gesture.config import GestureConfig
from deixis_headpose.config import HeadposeConfig
from deixis_runtime.settings import StageConfig
from deixis_runtime.site import Site
from deixis_schemas.schema_words import default_of, what
from deixis_tracker.config import TrackerConfig
from pydantic import BaseModel

CONFIGS: dict[str, type[StageConfig]] = {
    "camera": CameraConfig,
    "tracker": TrackerConfig,
    "headpose": HeadposeConfig,
    "gesture": GestureConfig,
    "fusion": FusionConfig,
}
FILES = {"confusion.hand", "confusion.head"}
"""Settings that name a file, whatever their model says of what is in it."""
WIDTH = "100"
SETTINGS = """# Settings

Written by `make pages` from the stages' `config.py`; edit these.

In a site file those of the camera stand under `camera`, those of the others under `settings` and the stage's name; on a
command line `--set stage.name=value` changes one (a stage that is started by itself takes `--set name=value`). The command
line counts before the file. A name that no stage knows, and a value out of bounds, are refused at the start, with the name
and where it was set. A stage's settings do not change while it runs.
"""
COMMANDS = """# Commands

Written by `make pages` from the commands' own help. Each stage is a command as well: `deixis-tracker --help`.
Exit status: 0 when a command did its job, 1 with the cause on standard error, 2 for bad usage, 128 and the signal's
number where it was stopped.
"""


def settings_page() -> str:
    """Every setting of every stage with its bounds, its default, and what it is."""
    lines = [SETTINGS]
    models: dict[str, type[BaseModel]] = {"The site file": Site, **CONFIGS}
    for heading, model in models.items():
        schema = model.model_json_schema()
        lines += _section(f"## {heading}", schema, schema.get("$defs", {}))
        for name, part in schema.get("$defs", {}).items():
            if f"#/$defs/{name}" in [content.get("items", {}).get("$ref") for content in schema["properties"].values()]:
                lines += _section(f"### {name}", part, {})
    return "\n".join(lines).rstrip() + "\n"


def _section(heading: str, schema: dict[str, Any], parts: dict[str, Any]) -> list[str]:
    return [f"{heading}\n", "| setting | what | default | |", "|---|---|---|---|", *_rows("", schema, parts), ""]


def _rows(prefix: str, schema: dict[str, Any], parts: dict[str, Any]) -> Iterator[str]:
    required = schema.get("required", [])
    for name, content in schema["properties"].items():
        if (name, schema["title"]) == ("path", "Site"):
            continue  # the file's own name, which no file holds
        described = " ".join(content.get("description", "").split()).replace("|", "\\|")
        if f"{prefix}{name}" in FILES:
            yield f"| `{prefix}{name}` | file | built in | {described} |"
            continue
        group = parts.get(content.get("$ref", "").rsplit("/", 1)[-1])
        if group is not None:
            yield from _rows(f"{prefix}{name}.", group, parts)
            continue
        default = "(needed)" if name in required else default_of(content)
        yield f"| `{prefix}{name}` | {what(content)} | {default} | {described} |"


def commands_page() -> str:
    """The help of every command, and of the commands below it."""
    os.environ["COLUMNS"] = WIDTH  # argparse folds its lines by it
    installed = sorted(entry.name for entry in entry_points(group="deixis.commands"))
    lines = [COMMANDS]
    for name in installed:
        for words, command in _commands((name,), _subparsers(parser(name))[name]):
            lines += [
                f"{'#' * (len(words) + 1)} deixis {' '.join(words)}\n",
                "```text",
                command.format_help().rstrip(),
                "```\n",
            ]
    return "\n".join(lines).rstrip() + "\n"


def _commands(
    words: tuple[str, ...], command: argparse.ArgumentParser
) -> Iterator[tuple[tuple[str, ...], argparse.ArgumentParser]]:
    yield words, command
    for name, below in _subparsers(command).items():
        yield from _commands((*words, name), below)


def _subparsers(command: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    for action in command._actions:  # argparse has no other way to ask
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


PAGES = {"settings.md": settings_page, "commands.md": commands_page}


def main() -> int:
    """Write the pages into this file's folder."""
    for name, page in PAGES.items():
        (Path(__file__).parent / name).write_text(page())
    return 0


if __name__ == "__main__":
    sys.exit(main())
