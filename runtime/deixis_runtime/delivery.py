"""What each delivery stance of the topic table means in Zenoh."""

from __future__ import annotations

from dataclasses import dataclass

import zenoh
from deixis_schemas.topics import Delivery


@dataclass(frozen=True)
class Profile:
    """Zenoh settings of a publisher."""

    priority: zenoh.Priority
    express: bool


# All drop rather than block: one frozen subscriber of a blocking publisher holds put for 5 s, loses its link and starves
# the healthy ones. What has to last ("keep") is held by its producer and answered to a get.
PROFILES: dict[Delivery, Profile] = {
    Delivery.BULK_NEWEST: Profile(zenoh.Priority.DATA_LOW, express=False),
    Delivery.NEWEST: Profile(zenoh.Priority.DATA_HIGH, express=True),
    Delivery.KEEP: Profile(zenoh.Priority.INTERACTIVE_HIGH, express=True),
    Delivery.KEEP_URGENT: Profile(zenoh.Priority.INTERACTIVE_HIGH, express=True),
    Delivery.REPLY: Profile(zenoh.Priority.INTERACTIVE_HIGH, express=True),
}
GET_PRIORITY = zenoh.Priority.INTERACTIVE_HIGH
