"""Which stages have a process: the liveliness tokens of a robot, followed."""

from __future__ import annotations

from collections.abc import Callable

import zenoh
from deixis_schemas import topics


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
