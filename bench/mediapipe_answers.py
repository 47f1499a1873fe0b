"""Asks MediaPipe in an interpreter of its own (mediapipe_referee.py), and keeps what it said so that it is asked but once."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from headpose_inputs import Footage, Source
from headpose_methods import MESH, MESH_PNP, Answers, Said

REFEREE = Path(__file__).with_name("mediapipe_referee.py")
KEPT = "referee.json"
TIMEOUT_S = 3600
YAWS = {MESH: "yaw_deg", MESH_PNP: "pnp_yaw_deg"}
"""Which yaw of a face is which method's."""


class RefereeError(RuntimeError):
    """MediaPipe cannot be asked; the text says why and what to do."""


def ask(sources: list[Source], python: Path | None, out: Path | None) -> dict[str, Any]:
    """What MediaPipe says of each, by name: processor time, and of each picture the faces.

    python: interpreter that has MediaPipe; none for this one. out: folder of what was said before. Raises RefereeError.
    """
    kept = _kept(out)
    known = {source.name: _identity(source) for source in sources}
    new = [source for source in sources if kept.get(source.name, {}).get("of") != known[source.name]]
    if new:
        answers = _run({source.name: _job(source) for source in new}, python)
        kept |= {name: {"of": known[name], **answer} for name, answer in answers.items()}
        if out is not None:
            (out / KEPT).write_text(json.dumps(kept), encoding="utf-8")
    return {name: kept[name] for name in known}


def answers_of(method: str, footage: Footage, asked: dict[str, Any]) -> Answers:
    """What was asked, as the answers of a method: the same for each frame that shows a picture."""
    asked_of, times = asked[footage.source.name], footage.source.shown
    faces = asked_of["frames"][: len(footage.frames) // times]
    frames = [[_said(face, YAWS[method]) for face in of_picture if face[YAWS[method]] is not None] for of_picture in faces]
    shown = [frame for frame in frames for _ in range(times)]
    missing: list[list[Said]] = [[] for _ in range(len(footage.frames) - len(shown))]
    return Answers(shown + missing, times * float(asked_of["cpu_s"]))


def _said(face: dict[str, Any], yaw: str) -> Said:
    x, y, w, h = face["bbox_px"]
    return Said((x, y, w, h), face[yaw])


def _job(source: Source) -> dict[str, Any]:
    return {"paths": [str(path) for path in source.paths], "focal_px": source.focal_px}


def _identity(source: Source) -> dict[str, Any]:
    """What tells whether that which is kept is of the same pictures, wherever they lie."""
    stats = [path.stat() for path in source.paths]
    return {
        "files": [path.name for path in source.paths],
        "focal_px": source.focal_px,
        "bytes": sum(stat.st_size for stat in stats),
        "changed_ns": max(stat.st_mtime_ns for stat in stats),
    }


def _kept(out: Path | None) -> dict[str, Any]:
    if out is None or not (out / KEPT).exists():
        return {}
    try:
        content = json.loads((out / KEPT).read_text(encoding="utf-8"))
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _run(jobs: dict[str, Any], python: Path | None) -> dict[str, Any]:
    command = [str(python or sys.executable), str(REFEREE)]
    try:
        done = subprocess.run(command, input=json.dumps(jobs), capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        if done.returncode == 0:
            answers: dict[str, Any] = json.loads(done.stdout)
            return answers
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        raise RefereeError(f"MediaPipe cannot be asked: {error}") from None
    if "No module named 'mediapipe'" in done.stderr:
        raise RefereeError(
            f"'{command[0]}' has no MediaPipe: install bench/requirements.txt in a venv of its own and give --mediapipe-python"
        )
    raise RefereeError(f"MediaPipe cannot be asked: {(done.stderr.strip().splitlines() or ['no reason given'])[-1]}")
