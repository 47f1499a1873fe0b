"""What was found, for people and for machines that run tests."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from rich.console import Console
from rich.text import Text

from .results import Result

# What XML 1.0 has no way to write, e.g. the colours in what a stage prints.
NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
MARKS = {"passed": ("ok   ", "green"), "failed": ("WRONG", "red"), "noted": ("note ", "yellow"), "skipped": ("skip ", "cyan")}


def print_report(stage: str, results: Sequence[Result], seconds: float) -> None:
    """One line a check, the advice below it."""
    console = Console(soft_wrap=True)
    for result in results:
        mark, style = MARKS[result.outcome]
        advice = f"\n        -> {result.advice}" if result.advice and result.outcome != "passed" else ""
        console.print(Text.assemble((mark, style), f" {result.name}: {result.found}{advice}"))
    counts = Counter(result.outcome for result in results)
    wrong = counts["failed"]
    passed = f"({counts['passed']} checks passed)"
    verdict = f"was not seen at work {passed}" if unseen(results) else f"keeps the contract {passed}"
    if wrong:
        verdict = f"{wrong} of {len(results)} checks failed"
    console.print(f"{stage}: {verdict}, {seconds:.0f} s", highlight=False)


def unseen(results: Sequence[Result]) -> bool:
    """Whether no answer of the stage could be judged, which is no proof that it keeps the contract."""
    return any(result.name == "answers" and result.outcome == "skipped" for result in results)


def document(stage: str, results: Sequence[Result], seconds: float) -> dict[str, Any]:
    """The JSON document of `--json`."""
    return {
        "stage": stage,
        "failed": sum(result.outcome == "failed" for result in results),
        "seconds": round(seconds, 1),
        "checks": [vars(result) for result in results],
    }


def write_junit(path: Path, stage: str, results: Sequence[Result], seconds: float) -> None:
    """The results as JUnit XML, which CI systems show. Raises OSError."""
    counts = Counter(result.outcome for result in results)
    suite = ElementTree.Element(
        "testsuite",
        name=f"deixis check-stage {stage}",
        tests=str(len(results)),
        failures=str(counts["failed"]),
        skipped=str(counts["skipped"]),
        time=f"{seconds:.3f}",
    )
    for result in results:
        said = NO_XML.sub("", result.found)
        case = ElementTree.SubElement(suite, "testcase", classname=f"deixis.{stage}", name=result.name)
        if result.outcome == "failed":
            ElementTree.SubElement(case, "failure", message=said).text = result.advice
        elif result.outcome == "skipped":
            ElementTree.SubElement(case, "skipped", message=said)
        else:
            ElementTree.SubElement(case, "system-out").text = said
    ElementTree.indent(suite)
    path.write_bytes(ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True))
