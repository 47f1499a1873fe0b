"""What is said of one head, look by look. Pure."""

from __future__ import annotations

from deixis_schemas.messages import HeadPose, Side

from .angles import sigma_deg
from .config import HeadposeConfig


class Head:
    """One person's head. A yaw is told when some looks in a row agree: a mesh that comes back from a profile slips at first."""

    def __init__(self, person_id: int, config: HeadposeConfig) -> None:
        self._person_id = person_id
        self._config = config
        self._yaw_deg: float | None = None
        self._agreed = 0
        self._was_read = False

    def look(self, yaw_deg: float | None) -> HeadPose:
        """The answer to the next look; `yaw_deg` is none where no face was read."""
        if yaw_deg is None:
            self._yaw_deg, self._agreed = None, 0
            return HeadPose(person_id=self._person_id, status="lost" if self._was_read else "initialising")
        near = self._yaw_deg is None or abs(yaw_deg - self._yaw_deg) <= self._config.jump_deg
        self._agreed = self._agreed + 1 if near else 1
        self._yaw_deg = yaw_deg
        if self._agreed < self._config.looks_to_start:
            return HeadPose(person_id=self._person_id, status="lost" if self._was_read else "initialising")
        self._was_read = True
        if abs(yaw_deg) > self._config.reach_deg:
            side: Side = "left" if yaw_deg > 0 else "right"
            return HeadPose(person_id=self._person_id, status="out_of_range", side=side, beyond_deg=self._config.reach_deg)
        return HeadPose(person_id=self._person_id, status="tracking", yaw_deg=yaw_deg, yaw_sigma_deg=sigma_deg(yaw_deg))
