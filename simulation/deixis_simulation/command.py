"""`deixis simulate`: render labelled clips of people who point, wave, talk, walk and look about, with exact truth.

Clip i of a seed is the same whatever count, jobs and order are; clips that are there already are skipped.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from deixis_cli.options import CommandError

from .draw import MAX_SEED, draw_scene
from .draw_layout import DrawingError
from .draw_lens import Overrides, Size
from .draw_plain import ASPECT as PLAIN_ASPECT
from .framing import LOWEST_ASPECT
from .jobs import Interrupted, Outcome, render_all
from .progress import shown_progress
from .scene import KINDS, Camera, Kind, Scene, SceneError, dump_scene, load_scene

MAX_COUNT = 100_000
FOV_LIMITS_DEG = (30.0, 110.0)
"""What scenes can be drawn for: head and hand have to be in the picture."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "simulate", help="render labelled clips", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder that gets NAME.mp4 and NAME.json (required to render)")
    parser.add_argument("--count", type=_whole(1, MAX_COUNT), default=1, metavar="N", help="number of clips (default: 1)")
    parser.add_argument(
        "--seed",
        type=_whole(0, MAX_SEED - 1),
        default=0,
        metavar="S",
        help="below 1000: to fit on; 1000 to 1999: to choose by; from 2000: to report (default: 0)",
    )
    parser.add_argument(
        "--plain", action="store_true", help="plain scenes: upright camera that stands, steady light, one person or two"
    )
    parser.add_argument("--kinds", type=_kinds, default=KINDS, metavar="KINDS", help=f"of {','.join(KINDS)} (default: all)")
    parser.add_argument("--size", type=_size, metavar="WxH", help="size of the pictures, e.g. 640x480 (default: drawn)")
    parser.add_argument("--fov", type=_fov, metavar="A-B", help="horizontal field of view, degrees (default: drawn)")
    parser.add_argument("--jobs", type=_whole(1, 256), metavar="J", help="clips at a time (default: one a processor)")
    parser.add_argument("--labels", action="store_true", help="write label pictures too, NAME_labels.npz")
    parser.add_argument(
        "--scene",
        type=Path,
        metavar="FILE",
        help="render this scene: YAML, or the JSON of a clip; it is named after the file",
    )
    parser.add_argument("--dry-run", action="store_true", help="write scenes only: NAME.yaml in --out, or on standard output")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Render. 0 when all clips are there, 1 when one is not, 130 when stopped. Raises CommandError."""
    scenes = _scenes(given)
    if given.dry_run:
        return _write_scenes(scenes, given.out)
    if given.out is None:
        raise CommandError("--out DIR: say where the clips go (or --dry-run)")
    try:
        with shown_progress(scenes) as progress:
            outcome = render_all(scenes, given.out, jobs=given.jobs, labels=given.labels, progress=progress)
    except Interrupted as interrupt:
        done = len(interrupt.outcome.rendered) + len(interrupt.outcome.skipped)
        print(f"deixis simulate: stopped; {done} of {len(scenes)} clips are finished in '{given.out}'", file=sys.stderr)
        print("the same command goes on from there", file=sys.stderr)
        return 130
    except OSError as error:
        raise CommandError(f"--out {given.out}: {error.strerror or error}") from None
    return _tell(outcome, given.out)


def drawn_scenes(
    seed: int,
    count: int,
    kinds: Sequence[Kind] = KINDS,
    size: Size | None = None,
    fov_deg: tuple[float, float] | None = None,
    *,
    plain: bool = False,
) -> list[Scene]:
    """The first scenes of a seed. Raises CommandError."""
    if plain and size is not None and size[1] / size[0] < PLAIN_ASPECT:
        raise CommandError(f"--size {size[0]}x{size[1]}: plain scenes are 4:3; wider ones would cut heads off")
    try:
        return [draw_scene(seed, index, kinds, Overrides(size, fov_deg), plain=plain) for index in range(count)]
    except DrawingError as error:
        raise CommandError(str(error)) from None


def _scenes(given: argparse.Namespace) -> list[Scene]:
    if given.scene is None:
        return drawn_scenes(given.seed, given.count, given.kinds, given.size, given.fov, plain=given.plain)
    if not re.fullmatch(r"[A-Za-z0-9_.\-]{1,100}", given.scene.stem):
        raise CommandError(f"--scene {given.scene}: the clip gets the file's name: letters, digits, '_', '.', '-'")
    try:
        return [load_scene(given.scene).model_copy(update={"name": given.scene.stem})]
    except SceneError as error:
        raise CommandError(str(error)) from None


def _write_scenes(scenes: Sequence[Scene], folder: Path | None) -> int:
    if folder is None:
        print("---\n".join(dump_scene(scene) for scene in scenes), end="")
        return 0
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for scene in scenes:
            (folder / f"{scene.name}.yaml").write_text(dump_scene(scene), encoding="utf-8")
    except OSError as error:
        raise CommandError(f"--out {folder}: {error.strerror or error}") from None
    return 0


def _tell(outcome: Outcome, folder: Path) -> int:
    there = f", {len(outcome.skipped)} were there already" if outcome.skipped else ""
    print(f"{len(outcome.rendered)} clips rendered into '{folder}'{there}")
    for name, why in outcome.failed.items():
        print(f"deixis simulate: {name}: {why}", file=sys.stderr)
    return 1 if outcome.failed else 0


def _whole(low: int, high: int) -> Any:
    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{text}' is not a whole number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{value} is not within {low} to {high}")
        return value

    return read


def _kinds(text: str) -> tuple[Kind, ...]:
    wanted = {name.strip() for name in text.split(",")}
    unknown = sorted(wanted - set(KINDS))
    if unknown:
        raise argparse.ArgumentTypeError(f"'{unknown[0]}' is none of {', '.join(KINDS)}")
    return tuple(kind for kind in KINDS if kind in wanted)


def _size(text: str) -> Size:
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size such as 640x480")
    width, height = int(match[1]), int(match[2])
    try:
        Camera(width=width, height=height)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}': even, 160x120 to 4096x4096") from None
    if height / width < LOWEST_ASPECT:
        raise argparse.ArgumentTypeError(f"'{text}': wider than 16:9; heads would be cut off")
    return width, height


def _fov(text: str) -> tuple[float, float]:
    match = re.fullmatch(r"(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is not a range such as 50-90")
    low, high = float(match[1]), float(match[2])
    if not FOV_LIMITS_DEG[0] <= low <= high <= FOV_LIMITS_DEG[1]:
        raise argparse.ArgumentTypeError(f"'{text}': from {FOV_LIMITS_DEG[0]:.0f} to {FOV_LIMITS_DEG[1]:.0f}, the lower first")
    return low, high
