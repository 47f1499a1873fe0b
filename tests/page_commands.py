"""The commands that stand on the pages for users: in blocks, line by line, and whole ones in sentences."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from deixis_cli.main import parser
from own_environment import own_environment
from running import ROOT

PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted(ROOT.glob("*/README.md")),
    *sorted(ROOT.glob("*/*/README.md")),
]
FENCE = re.compile(r"^[ ]*```(\w*)\n(.*?)^[ ]*```", re.DOTALL | re.MULTILINE)
SHELL = "sh"
"""The language of a block of commands; a block of anything else says what it is."""
IN_A_SENTENCE = re.compile(r"`((?:\.venv/bin/|make |deixis )[^`]+)`")
DEIXIS = "deixis"
# What a reader is to put in, or to choose.
PLACEHOLDER = re.compile(r"\.\.\.|…|[\[|]|\b[A-Z]+\b(?!=)")


@dataclass(frozen=True)
class Command:
    """A line to be typed, without its comment, and the page that it stands on."""

    page: str
    line: str

    def __str__(self) -> str:
        return f"{self.page}: {self.line}"


def blocks(page: Path) -> list[tuple[str, str]]:
    """Language and text of each block of a page."""
    return [(found[1], found[2]) for found in FENCE.finditer(page.read_text())]


def commands() -> list[Command]:
    """Of all pages in their order; a line that stands on several pages, or with and without its folder, once."""
    found: dict[tuple[str, str], Command] = {}
    for page in PAGES:
        for line in [*_in_blocks(page), *_in_sentences(page)]:
            name = page.relative_to(ROOT).as_posix()
            # Certificates are what other lines of the same page need.
            again = name if "deixis certs " in line else ""
            found.setdefault((line.removeprefix(".venv/bin/"), again), Command(name, line))
    return list(found.values())


def _in_blocks(page: Path) -> Iterator[str]:
    for language, text in blocks(page):
        if language == SHELL:
            for line in re.sub(r"\s*\\\n\s*", " ", text).splitlines():
                if command := re.sub(r"(^|\s+)# .*$", "", line).strip():
                    yield command


def _in_sentences(page: Path) -> Iterator[str]:
    for found in IN_A_SENTENCE.findall(FENCE.sub("", page.read_text())):
        line = " ".join(found.split())
        if not PLACEHOLDER.search(line) and (DEIXIS not in line.split()[0] or _is_whole(line)):
            yield line


def _is_whole(line: str) -> bool:
    """Whether it is meant to be typed: `deixis eval` in a sentence is but a name, as is one that lacks what it needs."""
    _, *words = shlex.split(line)
    name, *arguments = words or [""]
    if not any(word.startswith("-") or "." in word for word in arguments):
        return False
    try:
        with contextlib.redirect_stderr(io.StringIO()), own_environment():
            parser(name).parse_args([name, *arguments])
    except SystemExit:
        return False
    return True
