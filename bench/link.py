"""Robot and edge on good and bad links: how old answers are, how soon a cut is noticed and got over, bytes on the link.

usage: python bench/link.py [--layouts adapted,fixed,peers] [--links good,loss,8mbit,2mbit,cut2,cut30] [--seconds N]
                            [--json FILE]

Two hosts are made of namespaces with a link that a thread here relays (tests/two_hosts.py): that needs root. On the robot runs
the camera, which plays examples/pointing.mp4 again and again; on the edge all else; real processes. The layouts, one after the
other in the same run: `adapted`, a router on each host and the camera as it comes; `fixed`, the same with `camera.adapt=false`
and JPEGs of quality 85; `peers`, the same frames without routers, each stage a peer linked to all others (bench/peer_stage.py).

Links: good; loss, 20 ms each way and 1 % of packets lost; 8mbit and 2mbit each way, with a queue of 200 ms; cut2 and cut30, a
good link that is cut for 2 and 30 s. Figures, each as LAYOUT_LINK_FIGURE, over N seconds after the link has been so for 3:
* belief_age_ms_p50, _p95, target_age_ms_p50, _p95: from the capture of a frame to the receipt of what fusion answers to it, on
  the edge (one clock: the hosts are one machine); beliefs_s: how many a second; targets: how many it were;
* link_kb_s: bytes a second that went through the link, both ways, with all headers;
* noticed_s: from the cut to the first word of it on the robot, camera's or router's; recovered_s: from the link's return
  to the first belief about a frame captured since; oldest_ms: the oldest frame that was answered from the cut on.
A figure that does not come within 20 s is left out, and a dash on screen.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from deixis_evaluation.machine import describe_machine, say_machine
from link_layouts import LAYOUTS, ROOT, Layout, LinkBenchError
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(ROOT / "tests"))
from two_hosts import TwoHosts, missing_for_two_hosts  # type: ignore[import-not-found]

GOOD: dict[str, float] = {"delay_ms": 0.0, "jitter_ms": 0.0, "loss": 0.0, "rate_mbit": 0.0}
LINKS: dict[str, dict[str, float]] = {
    "good": {},
    "loss": {"delay_ms": 20.0, "loss": 0.01},
    "8mbit": {"rate_mbit": 8.0},
    "2mbit": {"rate_mbit": 2.0},
}
CUTS = {"cut2": 2.0, "cut30": 30.0}
START_S = 30.0
SETTLE_S = 3.0
WATCHED_S = 20.0
TURN_S = 0.02
NOTICED = ("no link yet to", "no answer to its frames")

Line = dict[str, Any]


class Heard:
    """The lines that a listener wrote, as they grow."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._at = 0
        self.lines: list[Line] = []

    def read(self) -> list[Line]:
        """All lines so far."""
        if self._file.exists():
            with self._file.open() as file:
                file.seek(self._at)
                while (text := file.readline()).endswith("\n"):
                    self._at = file.tell()
                    self.lines.append(json.loads(text))
        return self.lines

    def beliefs(self) -> list[Line]:
        """Those of them that are beliefs."""
        return [line for line in self.read() if line["type"] == "Belief"]


def measure(layout_name: str, links: list[str], seconds: float) -> dict[str, float]:
    """The figures of one layout, by LINK_FIGURE. Raises LinkBenchError."""
    robot, edge = "robot", "edge"
    clip, site = ROOT / "examples" / "pointing.mp4", ROOT / "examples" / "pointing.yaml"
    figures: dict[str, float] = {}
    with (
        tempfile.TemporaryDirectory() as folder,
        TwoHosts(robot, edge) as hosts,
        Layout(layout_name, hosts, Path(folder), clip, site) as layout,
    ):
        heard = Heard(layout.heard[edge])
        if await_first(layout, heard.beliefs, START_S) is None:
            raise LinkBenchError(f"{layout_name}: no belief within {START_S:g} s")
        for link in links:
            hosts.link(**GOOD | LINKS.get(link, {}))
            watch(layout, SETTLE_S)
            found = cut(layout, CUTS[link], heard) if link in CUTS else steady(layout, seconds, heard)
            figures |= {f"{link}_{name}": value for name, value in found.items()}
    return figures


def watch(layout: Layout, seconds: float) -> None:
    """Let it run. Raises LinkBenchError."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        layout.check()
        time.sleep(TURN_S)


def await_first(layout: Layout, found: Callable[[], Any], longest_s: float) -> float | None:
    """Seconds until `found` gives something true; None where it does not. Raises LinkBenchError."""
    began_s = time.monotonic()
    while time.monotonic() - began_s < longest_s:
        layout.check()
        if found():
            return time.monotonic() - began_s
        time.sleep(TURN_S)
    return None


def steady(layout: Layout, seconds: float, heard: Heard) -> dict[str, float]:
    """Ages and bytes while the link stays as it is."""
    bytes_before, began_s = layout.hosts.statistics.bytes, time.time()
    watch(layout, seconds)
    long_s = time.time() - began_s
    sent = layout.hosts.statistics.bytes - bytes_before
    lines = [line for line in heard.read() if line["at_s"] >= began_s]
    figures = {"link_kb_s": sent / 1e3 / long_s}
    for name, kind in (("belief", "Belief"), ("target", "Target")):
        ages_ms = [1e3 * line["age_s"] for line in lines if line["type"] == kind]
        figures |= {f"{name}s_s": len(ages_ms) / long_s} if name == "belief" else {f"{name}s": len(ages_ms)}
        if ages_ms:
            figures |= {f"{name}_age_ms_p{p}": float(np.percentile(ages_ms, p)) for p in (50, 95)}
    return figures


def cut(layout: Layout, seconds: float, heard: Heard) -> dict[str, float]:
    """Cut the link for so long."""
    robot = layout.hosts.names[0]
    said, at_robot = len(layout.log(robot, whole=True)) if layout.name != "peers" else 0, Heard(layout.heard[robot])
    notes_before = len(at_robot.read())

    def noticed() -> bool:
        log = layout.log(robot, whole=True)[said:] if layout.name != "peers" else ""
        notes = [note for line in at_robot.read()[notes_before:] for note in line["notes"]]
        return any(word in text for word in NOTICED for text in (log, *notes))

    figures: dict[str, float] = {}
    cut_s = time.time()
    layout.hosts.cut()
    noticed_s = await_first(layout, noticed, seconds)
    watch(layout, max(0.0, seconds - (time.time() - cut_s)))
    back_s = time.time()
    layout.hosts.restore()

    def recovered() -> bool:
        return any(line["at_s"] - line["age_s"] >= back_s for line in heard.beliefs())

    await_first(layout, recovered, WATCHED_S)
    watch(layout, SETTLE_S)
    answered = [line for line in heard.beliefs() if line["at_s"] >= cut_s]
    since = [line["at_s"] for line in answered if line["at_s"] - line["age_s"] >= back_s]
    if noticed_s is not None:
        figures["noticed_s"] = noticed_s
    if since:
        figures["recovered_s"] = min(since) - back_s
        figures["oldest_ms"] = 1e3 * max(line["age_s"] for line in answered)
    return figures


def tables(figures: dict[str, float], layouts: list[str], links: list[str]) -> list[Table]:
    """One for the links that stay as they are, one for those that are cut."""
    shown = {
        "links": (
            [link for link in links if link in LINKS],
            (
                "belief_age_ms_p50",
                "belief_age_ms_p95",
                "target_age_ms_p50",
                "target_age_ms_p95",
                "beliefs_s",
                "targets",
                "link_kb_s",
            ),
        ),
        "cuts": ([link for link in links if link in CUTS], ("noticed_s", "recovered_s", "oldest_ms")),
    }
    made = []
    for title, (rows, columns) in shown.items():
        if not rows:
            continue
        table = Table(title=title, box=None)
        for name in ("link", "layout", *columns):
            table.add_column(name, justify="left" if name in ("link", "layout") else "right")
        for link in rows:
            for layout in layouts:
                values = [figures.get(f"{layout}_{link}_{column}") for column in columns]
                texts = ["-" if value is None else f"{value:.1f}" if abs(value) < 100 else f"{value:.0f}" for value in values]
                table.add_row(link, layout, *texts)
        made.append(table)
    return made


def chosen(text: str, known: list[str]) -> list[str]:
    """The names of a list with commas. Raises argparse.ArgumentTypeError for one that is not known."""
    names = text.split(",")
    for name in names:
        if name not in known:
            raise argparse.ArgumentTypeError(f"'{name}' is none of {', '.join(known)}")
    return names


def main() -> int:
    """Measure, show, and write where told to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--layouts", type=lambda text: chosen(text, list(LAYOUTS)), default=list(LAYOUTS))
    parser.add_argument("--links", type=lambda text: chosen(text, [*LINKS, *CUTS]), default=[*LINKS, *CUTS])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--json", type=Path, metavar="FILE")
    given = parser.parse_args()
    why_not = missing_for_two_hosts()
    if why_not:
        print(f"link.py: {why_not}", file=sys.stderr)
        return 1
    machine = describe_machine()
    figures: dict[str, float] = {}
    try:
        for layout in given.layouts:
            found = measure(layout, given.links, given.seconds)
            figures |= {f"{layout}_{name}": round(value, 3) for name, value in found.items()}
    except LinkBenchError as error:
        print(f"link.py: {error}", file=sys.stderr)
        return 1
    console = Console(width=None if sys.stdout.isatty() else 150)
    for name in given.layouts:
        console.print(f"{name}: {LAYOUTS[name]}")
    for table in tables(figures, given.layouts, given.links):
        console.print(table)
    console.print(say_machine(machine))
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
