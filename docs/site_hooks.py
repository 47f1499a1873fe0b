"""For mkdocs: links that leave docs/ name a file of the project, which the site does not have; there they become its name."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
OUTSIDE = re.compile(r"(?<!!)\[([^\]]+)\]\(\.\./([^)#]+)(#[^)]*)?\)")


def on_page_markdown(markdown: str, page: Any, **_: object) -> str:
    """The page without links to files outside docs/. Raises FileNotFoundError where a link names a file that is not there."""

    def named(found: re.Match[str]) -> str:
        text, path = found.group(1), found.group(2)
        if not (ROOT / path).exists():
            raise FileNotFoundError(f"{page.file.src_path}: a link to ../{path}, which is not there")
        return f"`{path}`" if text == path else f"{text} (`{path}`)"

    return OUTSIDE.sub(named, markdown)
