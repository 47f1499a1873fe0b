"""Settings of a stage's core that is played in this process, as its own process would read them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from deixis_cli.options import CommandError
from deixis_runtime.settings import CommonOptions, ConfigError, StageConfig, load_config

from .replay import INSTANCE

C = TypeVar("C", bound=StageConfig)


def core_config(stage: str, model: type[C], sets: Mapping[str, Sequence[str]]) -> C:
    """The defaults, and what `--set STAGE.NAME=VALUE` says of that stage. Raises CommandError."""
    options = CommonOptions(
        robot="eval",
        instance=INSTANCE,
        connect="",
        lockstep=True,
        supervised=False,
        started_before=0,
        site=None,
        sets=tuple(sets.get(stage, ())),
    )
    try:
        return load_config(stage, model, options)
    except ConfigError as error:
        raise CommandError(str(error)) from None
