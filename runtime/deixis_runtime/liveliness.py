"""Which stages have a process: the liveliness tokens of a robot, followed."""

from __future__ import annotations

from collections.abc import Callable

import zenoh
from deixis_schemas import topics


class StandingBy:
    """Follows who of a stage stands by, as long as it is referenced."""

    def __init__(self, session: zenoh.Session, robot: str, stage: str) -> None:
        self._tokens: set[str] = set()
        key = topics.standby_alive_key(robot, stage, "*")
        self._subscriber = session.liveliness().declare_subscriber(key, self._note, history=True)

    def instances(self) -> set[str]:
        """Names of the processes that stand by."""
        return {key.split("/")[-2] for key in tuple(self._tokens)}

    def _note(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._tokens.add(key)
        else:
            self._tokens.discard(key)


class AliveStages:
    """Follows the tokens as long as it is referenced. A hung process keeps its token; health tells."""

    def __init__(self, session: zenoh.Session, robot: str, wake: Callable[[], None] = lambda: None) -> None:
        self._tokens: set[str] = set()
        self._wake = wake
        key = topics.alive_key(robot, "*", "*")
        self._subscriber = session.liveliness().declare_subscriber(key, self._note, history=True)

    def stages(self) -> set[str]:
        """Names of the stages whose token stands."""
        return {key.split("/")[-2] for key in tuple(self._tokens)}

    def processes(self) -> set[tuple[str, str]]:
        """(stage, instance) of the processes whose token stands."""
        return {(key.split("/")[-2], key.split("/")[-1]) for key in tuple(self._tokens)}

    def _note(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._tokens.add(key)
        else:
            self._tokens.discard(key)
        self._wake()
