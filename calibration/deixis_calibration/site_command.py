"""`deixis calibrate site`: stand here, point at that. Says whether POIs are told apart, how the camera is really mounted, and
how often hand and head are misread here.

Exit status: 0 when all POIs are told apart, 3 when some are not, 130 when ended early (what was pointed at until then counts).
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from typing import Any

from deixis_cli.inbox import Inbox
from deixis_cli.mcap_file import McapFileError, McapReader
from deixis_cli.options import CommandError, add_connect, read_site
from deixis_fusion.config import FusionConfig
from deixis_runtime.settings import checked_name
from deixis_runtime.site import Site, SiteError
from deixis_schemas import topics
from deixis_schemas.codec import say
from pydantic import ValidationError
from rich.console import Console

from .site_file import write_site
from .site_labels import Labels, LabelsError, load_labels, write_labels
from .site_live import LISTENED, Session, guide
from .site_report import SiteReport, document_of, judge, text_of
from .site_session import Heard, SessionError

SOME_CONFUSED, ENDED_EARLY = 3, 130


def register(parts: Any) -> None:
    """Add the command."""
    parser = parts.add_parser("site", help="check and correct the mount by pointing at known things", description=__doc__)
    parser.add_argument("--site", type=Path, required=True, metavar="FILE", help="the site file that the system runs with")
    parser.add_argument("--robot", type=checked_name, metavar="NAME", help="robot that runs; none with --from")
    add_connect(parser)
    parser.add_argument(
        "--stand", action="append", default=[], metavar="X,Y", help="where to stand, in the map, metres; again for more spots"
    )
    parser.add_argument("--rounds", type=int, default=2, metavar="N", help="times that each POI is pointed at (default: 2)")
    parser.add_argument("--only", default="", metavar="P1,P2", help="point at these alone (default: all of the site file)")
    parser.add_argument(
        "--height", type=float, metavar="METRES", help="height of the person, sole to crown: tilt is surer then"
    )
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep messages and labels there, for --from")
    parser.add_argument("--from", dest="recording", type=Path, metavar="FILE.mcap", help="judge a recording, with --labels")
    parser.add_argument("--labels", type=Path, metavar="FILE", help="who pointed at what, when, from where")
    parser.add_argument(
        "--out", type=Path, metavar="SITE.yaml", help="write the site file with what was measured, beside --site"
    )
    parser.add_argument("--force", action="store_true", help="write over files that are there")
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.set_defaults(run=run)


def run(given: argparse.Namespace) -> int:
    """Ask or read, judge, write. Raises CommandError or Unreachable."""
    site = read_site(given.site)
    if site is None or not site.pois:
        raise CommandError(f"site file {given.site}: pois: there are none to point at")
    config = _fusion_of(site)
    _check_out(given)
    try:
        heard, labels, early = _read(given) if given.recording else _ask(given, site)
        if not labels.pointings:
            return ENDED_EARLY
        with Console(stderr=True).status(f"weighing {len(labels.pointings)} pointings, as it is and as corrected ..."):
            report = judge(heard, labels, site, config, _source(given, labels))
        _write(given, report)
    except (SessionError, LabelsError, McapFileError, SiteError) as error:
        raise CommandError(str(error)) from None
    names = {poi.poi_id: poi.name for poi in site.pois}
    print(json.dumps(document_of(report)) if given.json else text_of(report, names))
    if early:
        return ENDED_EARLY
    return 0 if report.fit and all(one.verdict == "told apart" for one in report.after) else SOME_CONFUSED


def _fusion_of(site: Site) -> FusionConfig:
    try:
        return FusionConfig.model_validate(site.settings.get(topics.POI.stage, {}))
    except ValidationError as error:
        raise CommandError(f"site file {site.path}: settings.fusion: {say(error)}") from None


def _check_out(given: argparse.Namespace) -> None:
    """Raises CommandError, before anybody has to point."""
    if given.out is None:
        return
    if given.out.resolve().parent != given.site.resolve().parent:
        raise CommandError(f"--out {given.out}: has to lie beside {given.site}, for paths in it are relative")
    if given.out.exists() and not given.force:
        raise CommandError(f"--out {given.out}: is there already; --force writes over it")


def _read(given: argparse.Namespace) -> tuple[Heard, Labels, bool]:
    """A session from files. Raises CommandError, McapFileError or LabelsError."""
    if given.labels is None:
        raise CommandError("--from needs --labels: who pointed at what, when, from where")
    labels, heard, inbox = load_labels(given.labels), Heard(), Inbox()
    reader = McapReader(given.recording)
    for raw in reader:
        if topics.topic_of(raw.key) in LISTENED and (received := inbox.read(raw)) is not None:
            heard.hear(received.message)
    if reader.cut:
        print(f"deixis calibrate site: {reader.cut_off}", file=sys.stderr)
    if not heard.tracked():
        raise CommandError(f"'{given.recording}' holds no tracks")
    if not labels.pointings:
        raise CommandError(f"labels {given.labels}: pointings: there are none")
    for number, label in enumerate(labels.pointings):
        if label.from_s > heard.length_s:
            raise CommandError(
                f"labels {given.labels}: pointings.{number}: the labels lie after the recording's end: from {label.from_s:g} s "
                f"on, where '{given.recording}' ends at {heard.length_s:.1f} s"
            )
    return heard, labels, False


def _ask(given: argparse.Namespace, site: Site) -> tuple[Heard, Labels, bool]:
    """A session at a running system; without pointings only where it was ended before the first.

    Raises CommandError, Unreachable or McapFileError.
    """
    if given.robot is None:
        raise CommandError("give --robot NAME, or --from FILE.mcap with --labels FILE")
    if not given.stand:
        raise CommandError("give --stand X,Y: where somebody is to stand, in the map; three spots 1.5 to 3 m away are good")
    if not 1 <= given.rounds <= 20:
        raise CommandError(f"--rounds {given.rounds}: 1 to 20 can be")
    known = [poi.poi_id for poi in site.pois]
    chosen = [name.strip() for name in given.only.split(",") if name.strip()] or known
    unknown = [name for name in chosen if name not in known]
    if unknown:
        raise CommandError(f"--only {unknown[0]}: no POI of {given.site}")
    spots = {chr(ord("A") + number): _spot(text) for number, text in enumerate(given.stand[:26])}
    try:
        labels = Labels(spots=spots, person_height_m=given.height)
    except ValidationError as error:
        raise CommandError(say(error)) from None
    recording = given.keep / "session.mcap" if given.keep is not None else None
    session = Session(given.robot, given.connect, site, labels, chosen, given.rounds, recording)
    heard, labels, early = guide(session, Console(stderr=True))
    if not labels.pointings and not early:
        raise CommandError("nobody was seen to point")
    if labels.pointings and given.keep is not None:
        write_labels(given.keep / "labels.yaml", labels)
    return heard, labels, early


def _spot(text: str) -> tuple[float, float]:
    parts = re.fullmatch(r"\s*(-?\d+(?:\.\d+)?)\s*,\s*(-?\d+(?:\.\d+)?)\s*", text)
    if parts is None:
        raise CommandError(f"--stand {text}: not of the form X,Y in metres (before a minus sign: --stand=-1,2)")
    return float(parts[1]), float(parts[2])


def _source(given: argparse.Namespace, labels: Labels) -> str:
    where = given.recording.name if given.recording else f"a session of robot {given.robot}"
    return f"'deixis calibrate site': {len(labels.pointings)} pointings of {where}, added to the paper's table"


def _write(given: argparse.Namespace, report: SiteReport) -> None:
    """Raises CommandError."""
    if given.out is None:
        return
    if report.fit is None:
        print(f"deixis: --out {given.out} is not written: the mount cannot be judged", file=sys.stderr)
        return
    try:
        write_site(given.site, given.out, report.fit.mount, report.hand, report.head)
    except OSError as error:
        raise CommandError(f"--out {given.out}: {error.strerror or error}") from None
