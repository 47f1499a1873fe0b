"""Who may link to a site's routers, and as what: the list that lies beside each router's certificate.

A certificate's common name is `ROLE:NAME`. Zenoh compares common names as they are, without patterns, so a router has to know
all names; and so a name that is taken from the list counts no more, though its certificate is in date.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args

from deixis_schemas.codec import say
from pydantic import BaseModel, ConfigDict, Field, ValidationError

Role = Literal["robot", "edge", "viewer", "editor"]
ROLES: tuple[Role, ...] = get_args(Role)
ROUTERS: tuple[Role, ...] = ("robot", "edge")
"""Roles of hosts with a router that others link to, or that links to others: they need the list."""
EDITORS: tuple[Role, ...] = ("edge", "editor")
"""Roles that may edit POIs; an edge passes on what editors ask of it."""
FRAME_READERS: tuple[Role, ...] = ("edge",)
"""Roles that are given frames, unless these stay with the robots."""

# An X.509 common name holds 64 characters; the longest role and the colon take 7 of them.
MEMBER_PATTERN = rf"^({'|'.join(ROLES)}):[A-Za-z0-9_][A-Za-z0-9_.\-]{{0,56}}$"
MAX_MEMBERS = 4096
MAX_BYTES = 1 << 20


class AccessError(ValueError):
    """A list of access that cannot be used; the text names the file."""


@dataclass(frozen=True, order=True)
class Member:
    """One holder of a certificate. A robot's name is that of its keys."""

    role: Role
    name: str

    def __str__(self) -> str:
        """The common name of its certificate."""
        return f"{self.role}:{self.name}"


class AccessList(BaseModel):
    """Content of `access.json`.

    frames_stay: frames do not leave the robot (pictures of people are private); then the stages that need them run there.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    members: tuple[Annotated[str, Field(pattern=MEMBER_PATTERN)], ...] = Field(max_length=MAX_MEMBERS)
    frames_stay: bool = False

    def of_role(self, role: Role) -> list[Member]:
        """The members of one role, by name."""
        return sorted(member for text in self.members if (member := member_of(text)) is not None and member.role == role)


def member_of(common_name: str) -> Member | None:
    """Who has a certificate of this common name; None where it is not `ROLE:NAME`."""
    if not re.fullmatch(MEMBER_PATTERN, common_name):
        return None
    role, _, name = common_name.partition(":")
    return next(Member(known, name) for known in ROLES if known == role)


def read_access(path: Path) -> AccessList:
    """The list in a file. Raises AccessError."""
    try:
        with path.open("rb") as file:
            text = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise AccessError(f"{path}: {error.strerror or error}") from None
    if len(text) > MAX_BYTES:
        raise AccessError(f"{path}: larger than {MAX_BYTES} bytes")
    try:
        return AccessList.model_validate_json(text)
    except ValidationError as error:
        raise AccessError(f"{path}: {say(error)}") from None
