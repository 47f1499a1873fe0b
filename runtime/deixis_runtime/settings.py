"""Settings of a stage: from the site file, then from `--set name=value`, checked by the stage's own model."""

from __future__ import annotations

import argparse
import os
import re
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import yaml
from deixis_schemas import topics
from deixis_schemas.codec import say
from deixis_schemas.messages import NAME_PATTERN
from pydantic import BaseModel, ConfigDict, ValidationError

from .certificates import add_certificates
from .session import DEFAULT_ENDPOINT
from .site import Site, SiteError, load_site

STARTED_BEFORE = "DEIXIS_STARTED_BEFORE"
"""Environment variable by which the supervisor tells a child how often it was started before."""
STAND_BY = "DEIXIS_STAND_BY"
"""Environment variable that has a stage stand by at its start, as --stand-by does: for stages in any language."""


class ConfigError(ValueError):
    """Settings that cannot be used; the text names the field and where it was set."""


class StageConfig(BaseModel):
    """Base of every stage's settings, and of their groups: a misspelt name is an error, a value does not change later."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


C = TypeVar("C", bound=StageConfig)


@dataclass(frozen=True)
class CommonOptions:
    """What every stage is told on its command line.

    started_before: how often its supervisor has started it before: 0 for the first process. stand_by: it is a newcomer, not
    heard until it has taken the place of the process that is (`deixis swap`).
    """

    robot: str
    instance: str
    connect: str
    lockstep: bool
    supervised: bool
    started_before: int
    site: Site | None
    sets: tuple[str, ...]
    stand_by: bool = False


def parse_options(stage: str, description: str, argv: list[str] | None) -> CommonOptions:
    """Read the command line of a stage. Raises ConfigError for a bad site file or environment; SystemExit for bad usage."""
    parser = argparse.ArgumentParser(prog=f"deixis-{stage}", description=description)
    parser.add_argument("--robot", required=True, type=checked_name, help="name of the robot, the second part of every key")
    parser.add_argument("--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT", help="Zenoh router (default: %(default)s)")
    add_certificates(parser)
    parser.add_argument("--site", type=Path, metavar="FILE", help="site file: camera, walls, points of interest, settings")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="sets", help="override one setting")
    parser.add_argument("--instance", type=checked_name, help="name of this process (default: host and process number)")
    parser.add_argument("--lockstep", action="store_true", help="time is that of the frames; for reproducible runs")
    if stage in topics.SWAPPABLE:
        parser.add_argument(
            "--stand-by", action="store_true", help="work unheard until 'deixis swap' gives it the place of another"
        )
    parser.add_argument("--supervised", action="store_true", help="stop when the parent process is gone")
    given = parser.parse_args(argv)
    stand_by = stage in topics.SWAPPABLE and (given.stand_by or os.environ.get(STAND_BY, "") not in ("", "0"))
    before = started_before(os.environ.get(STARTED_BEFORE, "0"))
    try:
        site = load_site(given.site) if given.site else None
    except SiteError as error:
        raise ConfigError(str(error)) from None
    return CommonOptions(
        robot=given.robot,
        instance=given.instance or (lockstep_instance(before) if given.lockstep and not stand_by else default_instance()),
        connect=given.connect,
        lockstep=given.lockstep,
        supervised=given.supervised,
        started_before=before,
        site=site,
        sets=tuple(given.sets),
        stand_by=stand_by,
    )


def load_config(stage: str, model: type[C], options: CommonOptions) -> C:
    """The stage's settings. Raises ConfigError."""
    content: dict[str, Any] = {}
    if options.site is not None:
        content |= options.site.settings.get(stage, {})
        content |= options.site.camera if stage == topics.FRAME.stage else {}
    for item in options.sets:
        name, separator, text = item.partition("=")
        if not separator:
            raise ConfigError(f"--set {item}: not of the form NAME=VALUE")
        content = _with(content, name.split("."), _value(item, text))
    try:
        return model.model_validate(content)
    except ValidationError as error:
        where = f" (site file {options.site.path}, --set)" if options.site else " (--set)"
        raise ConfigError(f"settings of {stage}: {say(error)}{where}") from None


def checked_name(text: str) -> str:
    """A name from the command line, checked: it becomes one part of a key. Raises argparse.ArgumentTypeError."""
    if not re.fullmatch(NAME_PATTERN, text):
        raise argparse.ArgumentTypeError(
            f"'{text}' is not a name: 64 letters, digits, '_', '.' and '-' at most, not beginning with '.' or '-'"
        )
    return text


def started_before(text: str) -> int:
    """How often the supervisor has started this stage before, from its environment variable. Raises ConfigError."""
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise ConfigError(f"{STARTED_BEFORE}: '{text[:40]}' is not a number of starts")
    return int(text)


def lockstep_instance(started_before: int) -> str:
    """Name of a process in lockstep: alike in every run, so that two runs give equal outputs."""
    return f"lockstep-{started_before}" if started_before else "lockstep"


def default_instance(pid: int | None = None) -> str:
    """Name of this process, or of that one of this host: host and process number."""
    host = re.sub(r"[^A-Za-z0-9_.\-]", "-", socket.gethostname()).lstrip(".-")[:40] or "host"
    return f"{host}-{os.getpid() if pid is None else pid}"


def _value(item: str, text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        raise ConfigError(f"--set {item}: the value is not YAML") from None


def _with(content: dict[str, Any], path: list[str], value: Any) -> dict[str, Any]:
    if len(path) == 1:
        return {**content, path[0]: value}
    inner = content.get(path[0])
    return {**content, path[0]: _with(inner if isinstance(inner, dict) else {}, path[1:], value)}
