"""What each delivery stance of the topic table means in Zenoh."""

from __future__ import annotations

from dataclasses import dataclass

import zenoh
from deixis_schemas.topics import SENT, Delivery


@dataclass(frozen=True)
class Profile:
    """Zenoh settings of a publisher."""

    priority: zenoh.Priority
    express: bool


PROFILES: dict[Delivery, Profile] = {
    stance: Profile(getattr(zenoh.Priority, sent.priority), sent.express) for stance, sent in SENT.items()
}
GET_PRIORITY = zenoh.Priority.INTERACTIVE_HIGH
