"""What fusion answers to a get of `fusion/state`: everything it knows, in lists as long as was asked for."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from deixis_runtime.queries import Refused, check_names
from deixis_schemas.messages import (
    MAX_LISTED,
    MAX_PERSONS,
    MAX_POIS,
    MAX_TEXT,
    NAME_PATTERN,
    FrameId,
    Producer,
    SourceState,
    State,
)
from deixis_schemas.plain_text import shown

from .fusion import Fusion
from .poi_edits import PoiEdits
from .registry import Registry
from .report import Rows

PARAMETERS = ("top", "poi", "person")


@dataclass(frozen=True)
class Asked:
    """What a selector asks for: so many rows (`?top=N`), one POI's rows (`?poi=ID`), one person (`?person=ID`)."""

    rows: Rows
    person_id: int | None = None

    @staticmethod
    def by(parameters: Mapping[str, str], registry: Registry, rows: int) -> Asked:
        """Read the selector's parameters; without `top` there are so many rows. Raises Refused with the parameter's name."""
        check_names(parameters, PARAMETERS)
        top = _number(parameters, "top", 1, MAX_POIS)
        poi_id = parameters.get("poi")
        if poi_id is not None and (not re.fullmatch(NAME_PATTERN, poi_id) or registry.get(poi_id) is None):
            raise Refused(f"poi: there is no POI '{shown(poi_id[:80])}'")
        return Asked(Rows(rows if top is None else top, poi_id, MAX_LISTED), _number(parameters, "person", 0, 2**63 - 1))

    def wants(self, person_id: int) -> bool:
        """Whether this person was asked for."""
        return self.person_id in (None, person_id)


@dataclass(frozen=True)
class Standing:
    """What the shell knows beside the core: who answers and when, the last frame, the sources, edits that were lost."""

    producer: Producer
    robot: str
    now_ns: int
    last: FrameId
    sources: Sequence[SourceState]
    edits_lost: int


def state_of(asked: Asked, standing: Standing, fusion: Fusion, registry: Registry, edits: PoiEdits) -> State:
    """The state as asked for. More than the topic allows is refused by the runtime, which says what to ask instead."""
    pois = registry.pois()
    named = None if asked.rows.poi_id is None else registry.get(asked.rows.poi_id)
    chosen = pois[: asked.rows.top] if named is None else [named]
    return State(
        stamp_ns=standing.now_ns,
        stage=standing.producer.stage,
        instance=standing.producer.instance,
        robot=standing.robot,
        sources=list(standing.sources),
        robot_pose=fusion.robot.newest,
        pois=chosen,
        pois_total=len(pois),
        persons=[report.message(asked.rows) for report in fusion.persons if asked.wants(report.person_id)],
        run=standing.last.run,
        last_seq=standing.last.seq,
        open_episodes=fusion.open_episodes()[:MAX_PERSONS],
        recent_targets=[report.message(asked.rows) for report in fusion.recent if asked.wants(report.person_id)],
        registry_path=str(registry.path)[:MAX_TEXT],
        edits_accepted=edits.accepted,
        edits_rejected=edits.rejected,
        edits_lost=standing.edits_lost,
        rejected_edits=list(edits.rejections),
    )


def _number(parameters: Mapping[str, str], name: str, least: int, most: int) -> int | None:
    text = parameters.get(name)
    if text is None:
        return None
    if not re.fullmatch("[0-9]{1,19}", text) or not least <= int(text) <= most:
        raise Refused(f"{name}: '{shown(text[:40])}' is not a whole number from {least} to {most}")
    return int(text)
