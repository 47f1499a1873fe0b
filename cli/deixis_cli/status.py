"""`deixis status`: who is alive, in what state, with which rates, ages, drops and processor time."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from deixis_runtime.session import open_client
from deixis_schemas.messages import ClockHealth, Health
from rich.console import Console
from rich.table import Table
from rich.text import Text

from .options import add_connect, add_json, add_robot
from .system import HEARD_ONLY, StageProcess, Standing, System, look

CPU_OVER_S = 0.5
PLAIN_WIDTH = 180
STYLES = {"ok": "green", "heard": "green", "stands by": "cyan", "degraded": "yellow"}
UNANSWERED = {"heard": HEARD_ONLY, "hung": "its process is alive but gives no answer: hung or stopped"}


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("status", help="who is alive: rates, ages, drops, CPU", description=__doc__)
    add_robot(parser)
    add_connect(parser)
    add_json(parser, "print one JSON document")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Show the system once. 1 when no stage of the robot is alive. Raises Unreachable without a router."""
    with open_client(given.connect, shared_memory=False) as session:
        system = look(session, given.robot, CPU_OVER_S)
    if given.json:
        print(json.dumps(document(system, given.connect)))
    elif system.processes or system.supervisors:
        print_system(system)
    if not system.processes:
        print(f"deixis status: the router at {given.connect} knows no stage of robot '{given.robot}'", file=sys.stderr)
        return 1
    return 0


def document(system: System, endpoint: str) -> dict[str, Any]:
    """The JSON document of `--json`."""
    return {
        "robot": system.robot,
        "endpoint": endpoint,
        "stages": [_process_document(system, process) for process in system.processes],
        "supervisors": [_process_document(system, process) for process in system.supervisors],
        "missing": system.missing(),
        "doubled": system.doubled(),
        "camera": system.camera.model_dump(mode="json") if system.camera else None,
        "pois": system.state.pois_total if system.state else None,
    }


def _process_document(system: System, process: StageProcess) -> dict[str, Any]:
    return {
        "stage": process.stage,
        "instance": process.instance,
        "state": system.standing(process),
        "alive": process.alive,
        "cpu_percent": None if process.cpu_percent is None else round(process.cpu_percent, 1),
        "health": process.health.model_dump(mode="json") if process.health else None,
    }


def print_system(system: System) -> None:
    """The system as a table, and what is odd below it."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=PLAIN_WIDTH)
    table = Table(box=None, pad_edge=False)
    for name in ("STAGE", "STATE", "PROCESS", "HOST", "UP", "CPU", "MB", "STEP", "OUT", "IN (rate, age, dropped, refused)"):
        table.add_column(name)
    for process in (*system.processes, *system.supervisors):
        table.add_row(*_row(process, system.standing(process)))
    console.print(table)
    for line in remarks(system):
        console.print(Text(line))


def remarks(system: System) -> list[str]:
    """What a reader of the table should know besides."""
    lines = [f"{stage}: not there" for stage in system.missing()]
    for process in (*system.processes, *system.supervisors):
        if process.health is None:
            lines.append(f"{process.stage}: {UNANSWERED[system.standing(process)]}")
            continue
        if process.health.state != "ok":
            lines.append(f"{process.stage}: {process.health.state}: {process.health.reason}")
        lines += [f"{process.stage}: {note}" for note in process.health.notes]
        lines += [_clock(process.health, clock) for clock in process.health.clocks]
        lines += [f"{process.stage}: refused {item.key}: {item.last_error}" for item in process.health.inputs if item.rejected]
    if system.camera is not None:
        camera = system.camera
        lines.append(f"camera: {camera.state}, {camera.source}, {camera.width} x {camera.height} at {camera.rate_hz:g}/s")
    if system.state is not None:
        lines.append(f"fusion: {system.state.pois_total} POIs, {len(system.state.persons)} persons")
    return lines + system.doubled()


def _clock(health: Health, clock: ClockHealth) -> str:
    """How another host's clock stands beside that of this stage's host."""
    way = "ahead of" if clock.ahead_s > 0 else "behind"
    whose = f"the clock of host {clock.host} ({clock.stage})"
    return (
        f"{whose} is {abs(clock.ahead_s):.4f} s {way} that of host {health.host} ({health.stage}), +- {clock.uncertain_s:.4f} s"
    )


def _row(process: StageProcess, standing: Standing) -> list[Text]:
    health = process.health
    state = Text(standing, style=STYLES.get(standing, "red"))
    head = [Text(process.stage), state, Text(process.instance)]
    if health is None:
        return [*head, *(Text("-") for _ in range(7))]
    cpu = "-" if process.cpu_percent is None else f"{process.cpu_percent:.0f}%"
    tail = [health.host, f"{health.uptime_s:.0f} s", cpu, f"{health.rss_mb:.0f}", f"{health.step_ms_p50:.1f} ms"]
    return [*head, *(Text(item) for item in [*tail, _outputs(health), _inputs(health)])]


def _outputs(health: Health) -> str:
    return "\n".join(f"{_short(item.key)} {item.rate_hz:.1f}/s" for item in health.outputs if not item.key.endswith("/health"))


def _inputs(health: Health) -> str:
    return "\n".join(
        f"{_short(item.key)} {item.rate_hz:.1f}/s, {'never' if item.age_s is None else f'{item.age_s:.1f} s'}, "
        f"{item.overwritten + item.too_old}, {item.rejected}"
        for item in health.inputs
    )


def _short(key: str) -> str:
    return "/".join(key.split("/")[2:])
