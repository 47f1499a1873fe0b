"""What a frame costs fusion's core, by the number of POIs: processor time of `Fusion.answer`, and the size of its Belief.

usage: python bench/fusion.py [--rounds N] [--json FILE]

One person, standing or walking to and fro before the camera, at rest or pointing for longer than evidence is kept; measured
angles and face vary from frame to frame. The frames are made beforehand, and nothing is sent. Walls stand around, 200 of them
but for the 8 POIs. Figures of each case, e.g. 1000_walking_pointing:
* ms_CASE: processor time a frame, the mean over frames. Every round does the same work, so of each frame the fastest round
  counts: what a busy machine adds is not fusion's;
* belief_bytes_CASE: the largest Belief, packed;
* in_sight_CASE: POIs in sight of the person in the last frame.
The musts are those of the issue "Fusion in full", for a frame; the exit is 1 where one does not hold.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from deixis_evaluation.machine import describe_machine, say_machine
from deixis_fusion.config import FusionConfig
from deixis_fusion.fusion import Fusion
from deixis_fusion.joining import JoinedFrame
from deixis_fusion.visibility import Wall
from deixis_schemas import codec
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import BEARING_STEP_DEG, BEARINGS, Belief, CameraInfo, Gestures, HeadPoses, Poi, Producer, Tracks
from rich.console import Console
from rich.table import Table

FOCAL_PX, WIDTH, HEIGHT = 560.0, 640, 480
K = (FOCAL_PX, 0.0, 319.5, 0.0, FOCAL_PX, 239.5, 0.0, 0.0, 1.0)
RATE_HZ = 30.0
# A stroke that is as long as it can count.
WARM_UP = int(RATE_HZ * FusionConfig().episodes.max_evidence_s) + 10
FRAMES = 60
ROOM_M = 20.0
WALL_M = 0.3
BELIEF_MUST_BYTES = 1 << 20


@dataclass(frozen=True)
class Size:
    """How many POIs and walls there are, and the most that a frame may cost."""

    pois: int
    walls: int
    must_ms: float


@dataclass(frozen=True)
class Case:
    """What is measured."""

    size: Size
    walking: bool
    pointing: bool

    @property
    def name(self) -> str:
        """The case as part of a figure's name."""
        return f"{self.size.pois}_{'walking' if self.walking else 'standing'}_{'pointing' if self.pointing else 'resting'}"


SIZES = (Size(8, 0, 0.5), Size(1000, 200, 5.0), Size(10_000, 200, 30.0))
CASES = [Case(size, walking, pointing) for size in SIZES for walking in (False, True) for pointing in (False, True)]


def measure(rounds: int) -> dict[str, float]:
    """The figures of all cases."""
    figures: dict[str, float] = {}
    for case in CASES:
        figures |= measure_case(case, rounds)
    return figures


def measure_case(case: Case, rounds: int) -> dict[str, float]:
    """Cost and size of one case."""
    frames = [frame(seq, case) for seq in range(WARM_UP + FRAMES)]
    spent_s, beliefs = zip(*(play(case, frames) for _ in range(rounds)), strict=True)
    return {
        f"ms_{case.name}": 1000 * float(np.min(spent_s, axis=0).mean()),
        f"belief_bytes_{case.name}": max(len(codec.encode(belief)) for belief in beliefs[0]),
        f"in_sight_{case.name}": beliefs[0][-1].persons[0].pois_total,
    }


def play(case: Case, frames: Sequence[JoinedFrame]) -> tuple[list[float], list[Belief]]:
    """Processor seconds of each frame after the warm-up, and what was answered."""
    fusion, spent_s, beliefs = core(), [], []
    for each in frames[:WARM_UP]:
        fusion.answer(each, {}, None)
    furnish(fusion, case.size)
    for each in frames[WARM_UP:]:
        began_s = time.process_time()
        belief, _ = fusion.answer(each, {}, None)
        spent_s.append(time.process_time() - began_s)
        beliefs.append(belief)
    return spent_s, beliefs


def core() -> Fusion:
    """Fusion with a camera and nothing to point at."""
    fusion = Fusion(FusionConfig(), Producer("fusion", "bench"))
    info: dict[str, Any] = {"stamp_ns": 0, "stage": "camera", "instance": "bench", "state": "streaming", "source": "bench"}
    fusion.set_camera(CameraInfo.model_validate(info | {"width": WIDTH, "height": HEIGHT, "camera_matrix": K}))
    return fusion


def furnish(fusion: Fusion, size: Size) -> None:
    """POIs and walls anywhere in a hall, the same ones each time."""
    rng = np.random.default_rng(7)
    places = rng.uniform(-ROOM_M / 2, ROOM_M / 2, (size.pois, 2))
    fusion.set_pois([Poi(poi_id=f"P{i}", position_m=(float(x), float(y), 1.2)) for i, (x, y) in enumerate(places)])
    fusion.set_walls([wall(rng) for _ in range(size.walls)])


def wall(rng: np.random.Generator) -> Wall:
    """A piece of a wall anywhere in the hall: as short as those of a map, so that half of what is there is seen."""
    x, y, way = rng.uniform(-ROOM_M / 2, ROOM_M / 2), rng.uniform(-ROOM_M / 2, ROOM_M / 2), rng.uniform(0, math.tau)
    return (x, y), (x + WALL_M * math.cos(way), y + WALL_M * math.sin(way))


def frame(seq: int, case: Case) -> JoinedFrame:
    """A frame in which all stages have spoken. The walker goes 1 m to either side at 2 to 3 m, at 1 m a second and more."""
    about: dict[str, Any] = {"run": 1, "seq": seq, "stamp_ns": 10**12 + int(seq / RATE_HZ * 1e9), "instance": "bench"}
    way, rng = seq / RATE_HZ if case.walking else 0.0, np.random.default_rng(seq)
    depth_m, right_m = 2.5 + 0.5 * math.sin(0.7 * way), math.sin(way)
    width_px, x_px = FOCAL_PX * FACE_WIDTH_M / depth_m, 319.5 + FOCAL_PX * right_m / depth_m
    face = {"track_id": 1, "person_id": 1, "kind": "face", "kind_probabilities": {"face": 1}, "velocity_px_s": (0, 0)}
    width_px *= 1 + rng.normal(0, 0.02)
    box = {"centroid_px": (x_px, 240), "bbox_px": (x_px - width_px / 2, 210, width_px, 1.3 * width_px)}
    pose = {"person_id": 1, "status": "tracking", "yaw_deg": rng.normal(50, 3), "yaw_sigma_deg": 4.0, "face_width_px": width_px}
    pose |= {"pitch_deg": rng.normal(-5, 3), "covariance_deg2": (16.0, 0.0, 0.0, 25.0, 0.0, 9.0)}
    stroke = {"phase": "stroke", "gesture": "point_left", "hand": "left", "bearing_deg": rng.normal(60, 8)}
    stroke |= {"bearing_sigma_deg": 12.0, "bearing_likelihood": curve(rng.normal(60, 8))}
    stroke |= {"elevation_deg": rng.normal(-10, 3), "elevation_sigma_deg": 9.0}
    gesture = {"person_id": 1} | (stroke if case.pointing else {"phase": "idle", "gesture": "none"})
    return JoinedFrame(
        Tracks.model_validate(about | {"stage": "tracker", "width": WIDTH, "height": HEIGHT, "tracks": [face | box]}),
        HeadPoses.model_validate(about | {"stage": "headpose", "poses": [pose]}),
        Gestures.model_validate(about | {"stage": "gesture", "gestures": [gesture]}),
    )


def curve(peak_deg: float) -> list[float]:
    """A likelihood of bearings as the gesture stage tells it."""
    off = (np.arange(BEARINGS) * BEARING_STEP_DEG - 180 - peak_deg + 180) % 360 - 180
    return [float(value) for value in np.exp(-0.5 * (off / 20) ** 2)]


def broken(figures: dict[str, float]) -> list[str]:
    """The musts that do not hold, in words."""
    slow = [
        f"{case.name}: {figures[f'ms_{case.name}']:.2f} ms a frame, must be under {case.size.must_ms:g}"
        for case in CASES
        if figures[f"ms_{case.name}"] >= case.size.must_ms
    ]
    large = [f"{name}: {value:.0f}" for name, value in figures.items() if "bytes" in name and value > BELIEF_MUST_BYTES]
    return slow + large


def figure_table(figures: dict[str, float]) -> Table:
    """One row a case, beside what it must be under."""
    table = Table("case")
    for title in ("POIs", "in sight", "walls", "ms a frame", "must", "Belief, bytes"):
        table.add_column(title, justify="right")
    for case in CASES:
        what = f"{'walking' if case.walking else 'standing'}, {'pointing' if case.pointing else 'resting'}"
        cost, packed = figures[f"ms_{case.name}"], figures[f"belief_bytes_{case.name}"]
        sight = figures[f"in_sight_{case.name}"]
        numbers = [
            f"{case.size.pois}",
            f"{sight:.0f}",
            f"{case.size.walls}",
            f"{cost:.2f}",
            f"< {case.size.must_ms:g}",
            f"{packed:.0f}",
        ]
        table.add_row(what, *numbers)
    return table


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, metavar="N", help="how often each case is played (default: 5)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write machine and figures to this file")
    given = parser.parse_args(argv)
    if given.rounds < 1:
        parser.error("argument --rounds: at least 1")
    figures = measure(given.rounds)
    machine = describe_machine()
    console = Console()
    console.print(figure_table(figures))
    console.print(say_machine(machine), highlight=False, markup=False, soft_wrap=True)
    if given.json is not None:
        given.json.write_text(json.dumps({"machine": machine, "figures": figures}, indent=1) + "\n", encoding="utf-8")
    failed = broken(figures)
    for line in failed:
        print(f"bench/fusion: {line}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
