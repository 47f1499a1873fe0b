"""What is said in words: the answer with its reason, and how the stages fare. Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from deixis_cli import wording
from deixis_schemas import topics
from deixis_schemas.messages import Evidence, Health, Target

from .frame_view import FrameView
from .known import Known

REASON, HEALTH = "reason", "health"
SILENT_NS = 3_000_000_000
MOST_FAULTS = 6


def reason_page(view: FrameView, known: Known, no_pictures: str) -> str:
    """The answer that was given last, why, and what the stages see now. no_pictures: why there are none, where that is so."""
    parts = [_answer(known.target, known) if known.target is not None else "# Nobody has pointed yet"]
    seen = list(_seen(view, known))
    parts += ["\n".join(_table(("stage", "sees"), seen))] if seen else []
    evidence = [item for person in (view.belief.persons if view.belief else []) for item in person.evidence]
    if evidence:
        parts.append("\n".join(_table(("evidence", "weight", "observed"), map(_evidence, evidence))))
    if no_pictures:
        parts.append(f"*No pictures: {no_pictures}*")
    return "\n\n".join(parts)


def health_page(known: Known, now_ns: int) -> str:
    """A row for each stage, and below what is wrong. now_ns: by the clock of who looks on."""
    stages = [stage for stage in topics.STAGES if stage in known.healths]
    stages += sorted(set(known.healths) - {*topics.STAGES, topics.SUPERVISOR})
    columns = ("stage", "is", "per s", "ms", "CPU", "MB", "dropped")
    rows = [_health_row(known.healths[stage], known, now_ns) for stage in stages]
    lines = _table(columns, rows) if rows else ["*No stage has said how it fares.*"]
    lockstep = ["", "*In lockstep stamps are media time, and tell of no delay.*"] if known.lockstep else []
    return "\n".join([*lines, "", *_faults(known), *lockstep])


def target_note(target: Target, known: Known) -> str:
    """A target in one line, for the log."""
    return wording.target_line(target, known.names)


def _answer(target: Target, known: Known) -> str:
    standing = {poi.poi_id: poi for poi in target.pois}
    title = f"# {_plain(wording.answer(target, known.names))}"
    figures = []
    for poi_id in target.poi_ids:
        if poi_id in standing:
            poi = standing[poi_id]
            figures.append(
                f"probability **{wording.chance(poi):.2f}**, belief {poi.belief:.2f}, plausibility {poi.plausibility:.2f}"
            )
    figures.append(f"conflict {target.conflict:.2f}, of hand and head {target.contour_conflict:.2f}")
    said = "answer" if target.final else "so far"
    return "\n\n".join([title, f"person {target.person_id}, {said}: {'; '.join(figures)}", _plain(target.reason)])


def _seen(view: FrameView, known: Known) -> Iterable[tuple[str, ...]]:
    if view.tracks is not None:
        yield topics.TRACKS.stage, wording.tracked(view.tracks)
    if view.poses is not None:
        yield topics.HEAD_POSES.stage, wording.heads(view.poses)
    if view.gestures is not None:
        yield topics.GESTURES.stage, wording.gestures(view.gestures)
    if view.belief is not None:
        yield topics.BELIEF.stage, wording.belief(view.belief, known.names)


def _evidence(item: Evidence) -> tuple[str, ...]:
    observed = item.observed if item.status == "ok" else f"{item.status}: {item.observed}"
    return item.source, f"{item.weight:.2f}", observed


def _health_row(health: Health, known: Known, now_ns: int) -> tuple[str, ...]:
    silent = now_ns - known.heard_ns[health.stage] > SILENT_NS
    rate_hz = max((output.rate_hz for output in health.outputs), default=0.0)
    cpu = known.cpu_percent.get(health.stage)
    dropped = sum(item.overwritten + item.too_old + item.rejected for item in health.inputs)
    return (
        health.stage,
        "**silent**" if silent else health.state if health.state == "ok" else f"**{health.state}**",
        f"{rate_hz:.0f}",
        f"{health.step_ms_p50:.1f}",
        "" if cpu is None else f"{cpu:.0f} %",
        f"{health.rss_mb:.0f}",
        f"{dropped}",
    )


def _faults(known: Known) -> list[str]:
    faults = [f"{stage}: {item.reason}" for stage, item in sorted(known.healths.items()) if item.state != "ok"]
    camera = known.camera
    if camera is not None and (camera.state != "streaming" or camera.reason):
        faults.insert(0, f"camera {camera.state}" + (f": {camera.reason}" if camera.reason else ""))
    return [f"* {_plain(fault)}" for fault in faults[:MOST_FAULTS]]


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    return [_row(columns), _row(["---"] * len(columns)), *(_row([_cell(cell) for cell in row]) for row in rows)]


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(text: str) -> str:
    return _plain(text).replace("|", "/")


def _plain(text: str) -> str:
    """Text of others in Markdown: nothing in it is a link or a picture to be fetched."""
    return text.replace("[", "(").replace("]", ")").replace("<", "‹").replace("\n", " ")
