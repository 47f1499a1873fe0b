"""The site file with its mount corrected and its tables measured: comments and order stay as they were."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from deixis_fusion.confusion import HandConfusion, HeadConfusion
from deixis_runtime.site import load_site
from deixis_schemas.messages import CameraMount

# ruamel.yaml: keeps comments, order and style of a file that people write; MIT, well kept.
from ruamel.yaml import YAML


def write_site(site: Path, out: Path, mount: CameraMount, hand: HandConfusion, head: HeadConfusion) -> None:
    """Write `out`, which must lie beside `site`: paths in it are relative. Raises OSError, or SiteError for what was no site.

    The file stands there whole or not at all.
    """
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 160
    content = yaml.load(site.read_text(encoding="utf-8")) or {}
    placed = _inner(_inner(content, "camera"), "mount")
    placed["yaw_deg"], placed["pitch_up_deg"] = round(mount.yaw_deg, 2), round(mount.pitch_up_deg, 2)
    confusion = _inner(_inner(_inner(content, "settings"), "fusion"), "confusion")
    confusion["hand"], confusion["head"] = _plain(hand.model_dump()), _plain(head.model_dump())
    part = out.with_name(f".{out.name}.part")
    try:
        with part.open("w", encoding="utf-8") as file:
            yaml.dump(content, file)
        load_site(part)
        os.replace(part, out)
    finally:
        part.unlink(missing_ok=True)


def _inner(content: Any, key: str) -> Any:
    if content.get(key) is None:
        content[key] = {}
    return content[key]


def _plain(content: dict[str, Any]) -> Any:
    """Rows of numbers in a line each."""
    yaml = YAML()
    made = yaml.map()
    for key, value in content.items():
        made[key] = _plain(value) if isinstance(value, dict) else _rows(yaml, value)
    if all(isinstance(value, float) for value in content.values()):
        made.fa.set_flow_style()
    return made


def _rows(yaml: YAML, value: Any) -> Any:
    if not isinstance(value, list):
        return value
    row = yaml.seq(_rows(yaml, item) for item in value)
    if not any(isinstance(item, list) for item in value):
        row.fa.set_flow_style()
    return row
