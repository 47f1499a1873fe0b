"""What a stage says of itself. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from deixis_schemas.messages import Health

from .observation import Phase, healths
from .results import Result, judged

LONGEST_BEAT_S = 2.5
"""Between two heartbeats, which come once a second."""

PUBLISH = "publish Health once a second and answer gets on its key: `deixis status` and `doctor` know no more than that"
BY_GET = "answer gets on {stage}/health with one Health"
FROM_LOOP = "publish Health once a second, from the loop that does the work"
COUNT = "advance `count` in the loop: it shows a hung one whose threads still live"
COUNT_REJECTED = "count them in inputs[].rejected, with last_error: who feeds you learns of it there"


def check_health(stage: str, phases: Sequence[Phase], replies: int, refused: str) -> list[Result]:
    """The heartbeat: by get, once a second, its count rising. A stage may do without; then it is noted."""
    beats = healths(stage, phases)
    if not beats and not replies:
        return [Result("health", "noted", refused or "no heartbeat, and no answer to a get of its health", PUBLISH)]
    said = f"{replies} replies to a get of its health"
    gaps = [later - sooner for (sooner, _), (later, _) in pairwise(beats)]
    steady = bool(gaps) and max(gaps) <= LONGEST_BEAT_S
    beating = f"{len(beats)} heartbeats" + (f", at most {max(gaps):.1f} s apart" if gaps else "")
    counts = [health.count for _, health in beats]
    rising = all(sooner < later for sooner, later in pairwise(counts))
    return [
        judged("health by get", said, None if replies == 1 else refused or said, BY_GET.format(stage=stage)),
        judged("heartbeat", beating, None if steady else beating, FROM_LOOP),
        judged("heartbeat counts", "`count` rises", None if rising else f"`count` goes {counts[:6]}", COUNT),
    ]


def check_says_rejected(stage: str, before: Sequence[Phase], after: Sequence[Phase], put: int) -> list[Result]:
    """Whether the heartbeat counts broken messages; nothing where there is no heartbeat."""
    old, new = healths(stage, before), healths(stage, after)
    if not old or not new:
        return []
    grown = _rejected(new[-1][1]) - _rejected(old[-1][1])
    if grown <= 0:
        return [Result("rejected", "noted", f"its health counts none of {put} broken messages", COUNT_REJECTED)]
    return [Result("rejected", "passed", f"its health counts {grown} rejected of {put} broken messages")]


def _rejected(health: Health) -> int:
    return sum(item.rejected for item in health.inputs)
