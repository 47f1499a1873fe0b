"""What a session says: which POIs are told apart, how the mount is to be changed, and the tables of this site."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from deixis_fusion.config import FusionConfig
from deixis_fusion.confusion import ConfusionConfig, HandConfusion, HeadConfusion
from deixis_fusion.localisation import wrapped_deg
from deixis_runtime.site import Site
from deixis_schemas.messages import CameraMount

from .mount_fit import MountFit, MountFitError, fit_mount
from .pointings import Pointing
from .site_confusion import Read, hand_table, head_table
from .site_labels import Labels
from .site_session import Heard, answer, measured
from .told_apart import Standing, Try, standings

NEAR_DEG = 20.0
"""POIs nearer to each other, seen from where somebody stood, are hard to tell apart."""


@dataclass(frozen=True)
class SiteReport:
    """before, after: how each POI fared as it was, and with mount and tables as corrected. There each pointing is judged by
    what was made of all the others: what it has helped to make would judge it too well.

    near: pairs of POIs with the degrees between them, from the spot where they lie closest. fit: none, with `why`, where too
    little was measured.
    """

    before: list[Standing]
    after: list[Standing]
    near: list[tuple[str, str, float]]
    pointings: int
    fit: MountFit | None
    why: str
    hand: HandConfusion
    head: HeadConfusion


@dataclass(frozen=True)
class Correction:
    """What some pointings say of a site. fit: none, with `why`, where they are too few."""

    fit: MountFit | None
    why: str
    tables: ConfusionConfig


def judge(heard: Heard, labels: Labels, site: Site, config: FusionConfig, source: str) -> SiteReport:
    """All that a session says; `source` is what the tables are named after. Raises SessionError."""
    pointings = measured(heard, labels, site)
    known = [one for one in pointings if one is not None]
    mount = heard.camera.mount if heard.camera is not None else CameraMount()
    whole = _correction(known, labels, site, mount, source)
    return SiteReport(
        before=standings([answer(heard, label, site, config, mount) for label in labels.pointings]),
        after=standings(list(_judged_by_the_others(heard, pointings, labels, site, config, mount))),
        near=near_pairs(site, labels),
        pointings=len(known),
        fit=whole.fit,
        why=whole.why,
        hand=whole.tables.hand,
        head=whole.tables.head,
    )


def _judged_by_the_others(
    heard: Heard, pointings: Sequence[Pointing | None], labels: Labels, site: Site, config: FusionConfig, mount: CameraMount
) -> Iterator[Try]:
    """What fusion would answer to each pointing, had it been corrected by all the others."""
    for number, label in enumerate(labels.pointings):
        others = [one for place, one in enumerate(pointings) if one is not None and place != number]
        made = _correction(others, labels, site, mount, "the others")
        corrected = config.model_copy(update={"confusion": made.tables})
        yield answer(heard, label, site, corrected, made.fit.mount if made.fit is not None else mount)


def _correction(pointings: Sequence[Pointing], labels: Labels, site: Site, mount: CameraMount, source: str) -> Correction:
    fit, why = None, ""
    try:
        fit = fit_mount(pointings, {poi.poi_id: poi for poi in site.pois}, labels.spots, mount, labels.person_height_m)
    except MountFitError as error:
        why = str(error)
    reads = list(_reads(pointings, site, labels))
    return Correction(fit, why, ConfusionConfig(hand=hand_table(reads, source), head=head_table(reads, source)))


def near_pairs(site: Site, labels: Labels) -> list[tuple[str, str, float]]:
    """Pairs of the POIs pointed at that lie near each other from some spot, the closest first."""
    asked = sorted({pointing.poi_id for pointing in labels.pointings})
    places = {poi.poi_id: poi.position_m for poi in site.pois}
    pairs = []
    for one, other in combinations([poi_id for poi_id in asked if poi_id in places], 2):
        gap = min(
            abs(wrapped_deg(_direction(spot, places[one]) - _direction(spot, places[other]))) for spot in labels.spots.values()
        )
        if gap < NEAR_DEG:
            pairs.append((one, other, gap))
    return sorted(pairs, key=lambda pair: pair[2])


def text_of(report: SiteReport, names: Mapping[str, str]) -> str:
    """For people."""
    lines = [f"{report.pointings} pointings measured; 'as corrected' each is judged by what the others say, and not by itself"]
    earlier = {standing.poi_id: standing for standing in report.before}
    for standing in report.after:
        before = earlier[standing.poi_id]
        instead = f"; answered instead: {', '.join(standing.instead[:3])}" if standing.instead else ""
        lines.append(
            f"  {standing.poi_id:8} {standing.verdict:10} named alone in {before.alone} of {before.tries} as it is, in "
            f"{standing.alone} as corrected{instead}  ({names.get(standing.poi_id) or standing.poi_id})"
        )
    lines += [f"  {one} and {other} lie {gap:.0f} degrees apart" for one, other, gap in report.near]
    lines += _mount_lines(report.fit) if report.fit is not None else [f"the mount cannot be judged: {report.why}"]
    return "\n".join(lines)


def document_of(report: SiteReport) -> dict[str, Any]:
    """For programs."""
    fit = report.fit
    return {
        "pointings": report.pointings,
        "before": [{**vars(standing), "verdict": standing.verdict} for standing in report.before],
        "after": [{**vars(standing), "verdict": standing.verdict} for standing in report.after],
        "near": report.near,
        "mount": None if fit is None else {**vars(fit), "mount": fit.mount.model_dump()},
        "why_no_mount": report.why,
        "hand": report.hand.model_dump(),
        "head": report.head.model_dump(),
    }


def _mount_lines(fit: MountFit) -> list[str]:
    lines = [
        f"camera.mount.yaw_deg: {fit.mount.yaw_deg:.2f} (changed by {fit.yaw_change_deg:+.2f} +- {fit.yaw_sigma_deg:.2f})",
        f"camera.mount.pitch_up_deg: {fit.mount.pitch_up_deg:.2f} (changed by {fit.pitch_change_deg:+.2f} +- "
        f"{fit.pitch_sigma_deg:.2f}; the head at {fit.head_height_m:.2f} m)",
    ]
    if not fit.is_needed:
        lines.append("  both changes are within what the session can tell: the mount is right as it is")
    if fit.hand_off_deg is not None:
        lines.append(
            f"  hands are off by {fit.hand_off_deg[0]:.1f} degrees as it is, {fit.hand_off_deg[1]:.1f} as corrected (median)"
        )
    if abs(fit.distance_ratio - 1) > 0.1:
        lines.append(f"  distances come out at {100 * fit.distance_ratio:.0f} % of the true ones: 'deixis calibrate camera'")
    return lines


def _reads(pointings: Sequence[Pointing], site: Site, labels: Labels) -> list[Read]:
    """Each pointing by the bearing of its POI, from where the person was asked to stand."""
    places = {poi.poi_id: poi.position_m for poi in site.pois}
    mount = site.camera.get("mount") or {}
    camera = tuple(mount.get("position_m", CameraMount().position_m))
    reads = []
    for one in pointings:
        if one.poi_id not in places:
            continue
        cos, sin = math.cos(math.radians(one.robot.yaw_deg)), math.sin(math.radians(one.robot.yaw_deg))
        at = one.robot.x_m + camera[0] * cos - camera[1] * sin, one.robot.y_m + camera[0] * sin + camera[1] * cos
        spot = labels.spots[one.spot]
        bearing = wrapped_deg(_direction(spot, places[one.poi_id]) - _direction(spot, at))
        reads.append(Read(bearing, one.gesture, one.yaw_deg))
    return reads


def _direction(spot: tuple[float, float], at: tuple[float, ...]) -> float:
    return math.degrees(math.atan2(at[1] - spot[1], at[0] - spot[0]))
