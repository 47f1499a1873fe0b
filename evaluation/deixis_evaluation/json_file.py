"""The file that `--json` names: refused before an hour of work where it cannot be written after it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from deixis_cli.options import CommandError


def check_writable(path: Path | None, option: str = "--json") -> None:
    """Make the file where the option names one. Raises CommandError."""
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("a", encoding="utf-8").close()
    except OSError as error:
        raise CommandError(f"{option} {path}: {error.strerror}") from None


def write_json(path: Path | None, content: dict[str, Any]) -> None:
    """Write the content where a file is named."""
    if path is not None:
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
