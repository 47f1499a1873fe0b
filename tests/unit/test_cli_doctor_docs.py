"""docs/doctor.md names every finding of the source in the words that doctor prints, and none that it does not print."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "doctor.md").read_text()
PACKAGES = ("cli/deixis_cli", "runtime/deixis_runtime", "services/camera/deixis_camera", "calibration/deixis_calibration")
# What doctor says comes from these; the other sources of a finding's text stand in the findings themselves.
PARTS_FROM = ("runtime/deixis_runtime/clock_watch.py", "runtime/deixis_runtime/endpoint.py", "cli/deixis_cli/system.py")
BLANK = "…"
# Less than a word of its own: what a stage says of itself, put behind its name.
FEWEST_LETTERS = 7


def source_files():
    files = [path for package in PACKAGES for path in sorted((ROOT / package).glob("*.py"))]
    return [path for path in files if "Finding(" in path.read_text()]


def template(node):
    """A text of the source with `…` for what is put in; none for another expression."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else BLANK for part in node.values)
    return None


def templates(tree):
    return {text for node in ast.walk(tree) if (text := template(node)) is not None}


def findings_of(function):
    """Templates of what the findings of a function say, but those that are `ok`."""
    assigned = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            assigned.setdefault(node.targets[0].id, []).append(template(node.value))
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Finding":
            level, what = node.args[:2]
            if template(level) != "ok":
                yield from assigned.get(what.id, []) if isinstance(what, ast.Name) else [template(what)]


def said_by_the_source():
    said = set()
    for path in source_files():
        functions = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)]
        said |= {text for function in functions for text in findings_of(function) if text}
    return sorted(text for text in said if len(re.findall("[a-z]", text)) >= FEWEST_LETTERS)


def told_by_the_page():
    first_columns = [line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `")]
    return [text for column in first_columns for text in re.findall("`([^`]+)`", column)]


def test_the_source_has_findings():
    assert len(said_by_the_source()) > 40


@pytest.mark.parametrize("text", said_by_the_source())
def test_each_finding_stands_on_the_page(text):
    assert text in told_by_the_page()


def test_the_page_tells_of_nothing_that_is_not_printed():
    files = [*source_files(), *(ROOT / path for path in PARTS_FROM)]
    printed = set().union(*(templates(ast.parse(path.read_text())) for path in files))
    assert [text for text in told_by_the_page() if text not in printed] == []
