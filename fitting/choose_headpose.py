"""Chooses how sure the regression of head pose is, and how its looks are filtered, on seeds that nothing was fitted on.

usage: python fitting/choose_headpose.py [DIR | --seeds A:B [--plain]] [--looks FILE]

Every head of every clip is read once, look by look (kept in --looks). Then, one after the other:
* `Calibration`: gain, apart, floor and turned of yaw, pitch, roll, by how likely they make the errors (Student's t with 4
  degrees of freedom: a few looks are far off, and a normal distribution would be ruled by them), then scaled so that 68 and
  95 % of the errors lie within one and 1.96 sigma as nearly as can be;
* `Motion` and `lasting`: by the mean error of the filtered yaw; then all sigmas are scaled once more, to its coverage.
The winners are printed as they stand in regressed_head.py and turn_filter.py.
"""

from __future__ import annotations

import argparse
import itertools
import pickle
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from deixis_evaluation.chosen_clips import Choice, choose
from deixis_evaluation.clips import Clip, ClipError, TruePerson
from deixis_evaluation.replay import RUN, Given
from deixis_evaluation.seeds import SeedsError
from deixis_evaluation.tracked_persons import TrackedPersons
from deixis_evaluation.true_angles import true_angles
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.head_reader import HeadReader
from deixis_headpose.regressed_head import CALIBRATION, Calibration, RegressedHead, angles_of, signs_of_error
from deixis_headpose.regression import Look, Regression
from deixis_headpose.sight import Sight, centre_of
from deixis_headpose.turn_filter import Motion
from deixis_runtime.lens import Lens
from deixis_schemas.messages import Producer, Tracks
from deixis_tracker.config import TrackerConfig
from deixis_tracker.tracker import Tracker
from numpy.typing import NDArray
from rich.console import Console
from scipy import optimize, stats

ANGLES = ("yaw", "pitch", "roll")
FREEDOM = 4.0
JERKINESS = ((10.0, 20.0, 40.0), (400.0, 800.0))
LASTING = (0.5, 0.7, 0.85)
LEAST_FLOOR_DEG = 0.5


@dataclass
class Reading:
    """One head in one frame: time, what was read (none: no head seen), and the truth (3,), degrees."""

    now_ns: int
    look: Look | None
    true_deg: NDArray[Any]


def main() -> int:
    """Read, choose, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR")
    parser.add_argument("--seeds", metavar="A:B")
    parser.add_argument("--plain", action="store_true", help="plain clips of these seeds, without difficulties")
    parser.add_argument("--looks", type=Path, help="keep what was read there, for the next run")
    given = parser.parse_args()
    cv2.setNumThreads(1)
    try:
        heads = _readings(given)
    except (ClipError, SeedsError) as error:
        print(f"choose_headpose: {error}", file=sys.stderr)
        return 2
    calibration = choose_calibration(heads)
    calibration, motion = choose_motion(heads, calibration)
    print(calibration)
    print(motion)
    return 0


def _readings(given: argparse.Namespace) -> list[list[Reading]]:
    if given.looks is not None and given.looks.exists():
        return list(pickle.loads(given.looks.read_bytes()))
    heads = []
    for clip in choose(Choice(given.folder, given.seeds, plain=given.plain), Console(stderr=True)).clips:
        heads += read_clip(clip)
        print(f"{clip.name}: read", file=sys.stderr)
    if given.looks is not None:
        given.looks.write_bytes(pickle.dumps(heads))
    return heads


def read_clip(clip: Clip) -> list[list[Reading]]:
    """The heads of a clip that are tracked, look by look."""
    given, tracker, regression = Given(clip), Tracker(TrackerConfig()), Regression()
    lens, persons = Lens.of(given.camera()), TrackedPersons(clip.truth)
    readers: dict[int, HeadReader] = {}
    heads: dict[int, list[Reading]] = {}
    for frame, picture in given.pictures():
        height, width = picture.shape[:2]
        found = tracker.update(picture, RUN, frame.stamp_ns)
        true = persons.match(Tracks.derive(frame, Producer("tracker", "fitting"), width=width, height=height, tracks=found))
        for face in (track for track in found if track.kind == "face" and track.person_id is not None):
            person = face.person_id or 0
            reader = readers.setdefault(person, HeadReader(regression))
            camera = lens.pinhole_at(centre_of(face), (width, height))
            look = reader.read(Sight(picture, camera, face, [], frame.stamp_ns))
            truth = _angles(true[person]) if person in true else np.full(3, np.nan)
            heads.setdefault(person, []).append(Reading(frame.stamp_ns, look, truth))
    return list(heads.values())


def _angles(person: TruePerson) -> NDArray[Any]:
    """True yaw, pitch and roll; not a number where the labels do not tell."""
    angles = true_angles(person.head)
    return np.array([np.nan if value is None else value for value in (angles.yaw, angles.pitch, angles.roll)])


# --- choosing -------------------------------------------------------------------------------------------------------------


def choose_calibration(heads: list[list[Reading]]) -> Calibration:
    """Gain, apart, floor and turned of each angle by likelihood, then scaled to the coverage wanted."""
    readings = [item for head in heads for item in head if item.look is not None and np.isfinite(item.true_deg).all()]
    looks = [item.look for item in readings if item.look is not None]
    errors = np.array(
        [differences(np.array(angles_of(look)), item.true_deg) for look, item in zip(looks, readings, strict=True)]
    )
    signs = np.array([signs_of_error(look) for look in looks])
    chosen = []
    for k, name in enumerate(ANGLES):
        parts = signs[:, :, k]
        start = np.log([0.8, 0.3, 1.5, 1.5])
        best = optimize.minimize(_unlikely, start, args=(errors[:, k], parts), method="Nelder-Mead", options={"maxiter": 2000})
        factors = np.exp(best.x)
        factors *= _scale(errors[:, k], np.sqrt(parts @ factors**2))
        factors[2] = max(factors[2], LEAST_FLOOR_DEG)
        chosen.append(factors)
        print(f"{name}: one look, {coverage(errors[:, k], np.sqrt(parts @ factors**2))}")
    gain, apart, floor, turned = (_rounded(column) for column in zip(*chosen, strict=True))
    return replace(CALIBRATION, gain=gain, apart=apart, floor_deg=floor, turned_deg=turned)


def choose_motion(heads: list[list[Reading]], calibration: Calibration) -> tuple[Calibration, Motion]:
    """The motion and the lasting share with the least mean error of the yaw; then the scale whose coverage is best."""
    tried = []
    for rest, turn, lasting in itertools.product(*JERKINESS, LASTING):
        item, motion = replace(calibration, lasting=lasting), Motion((rest, turn))
        errors, _ = filtered(heads, item, motion)
        tried.append((float(np.abs(errors).mean()), item, motion))
        print(f"jerkiness {rest:.0f}, {turn:.0f}, lasting {lasting}: mean error {tried[-1][0]:.2f}")
    _, calibration, motion = min(tried, key=lambda item: item[0])
    scaled = [_scaled(calibration, scale) for scale in np.linspace(0.6, 1.8, 13)]
    best = min(scaled, key=lambda item: _missed(*filtered(heads, item, motion)))
    print(f"filtered: {coverage(*filtered(heads, best, motion))}")
    return best, motion


def _scaled(calibration: Calibration, scale: float) -> Calibration:
    gain, apart, floor, turned = (
        _rounded([value * scale for value in values])
        for values in (calibration.gain, calibration.apart, calibration.floor_deg, calibration.turned_deg)
    )
    return replace(calibration, gain=gain, apart=apart, floor_deg=floor, turned_deg=turned)


def _rounded(values: Sequence[float]) -> tuple[float, float, float]:
    of_yaw, of_pitch, of_roll = (round(float(value), 2) for value in values)
    return of_yaw, of_pitch, of_roll


def filtered(heads: list[list[Reading]], calibration: Calibration, motion: Motion) -> tuple[NDArray[Any], NDArray[Any]]:
    """Error and stated sigma of the yaw in all frames that are tracked, degrees."""
    errors, sigmas = [], []
    for head in heads:
        follower = RegressedHead(HeadposeConfig(), Regression(), calibration, motion)
        for item in head:
            state = follower.take(item.look, item.now_ns)
            if state.angles_deg is not None and state.sigma_deg is not None and np.isfinite(item.true_deg[0]):
                errors.append(differences(np.array(state.angles_deg), item.true_deg)[0])
                sigmas.append(state.sigma_deg)
    return np.array(errors), np.array(sigmas)


def differences(angles_deg: NDArray[Any], true_deg: NDArray[Any]) -> NDArray[Any]:
    """Of angles (..., 3), each the short way round."""
    return np.asarray((angles_deg - true_deg + 180) % 360 - 180)


def coverage(errors: NDArray[Any], sigmas: NDArray[Any]) -> str:
    """Shares of errors within one and within 1.96 sigma, as text."""
    one, two = (float(np.mean(np.abs(errors) <= width * sigmas)) for width in (1.0, 1.96))
    return f"within 1 sigma {one:.1%}, within 1.96 sigma {two:.1%}"


def _unlikely(logs: NDArray[Any], errors: NDArray[Any], parts: NDArray[Any]) -> float:
    sigmas = np.sqrt(parts @ np.exp(2 * np.clip(logs, -6, 3)))
    return -float(stats.t.logpdf(errors / sigmas, FREEDOM).sum() - np.log(sigmas).sum())


def _scale(errors: NDArray[Any], sigmas: NDArray[Any]) -> float:
    scales = np.exp(np.linspace(-1, 1, 81))
    return float(min(scales, key=lambda scale: _missed(errors, scale * sigmas)))


def _missed(errors: NDArray[Any], sigmas: NDArray[Any]) -> float:
    ratios = np.abs(errors) / sigmas
    return abs(float(np.mean(ratios <= 1)) - 0.68) + abs(float(np.mean(ratios <= 1.96)) - 0.95)


if __name__ == "__main__":
    raise SystemExit(main())
