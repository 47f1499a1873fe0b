"""Message types of a ROS distribution: their bytes (CDR) and their hashes (RIHS01), by `rosbags`. Pure."""

from __future__ import annotations

from importlib import resources
from typing import Any, Literal, get_args

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

Distribution = Literal["humble", "jazzy", "kilted", "lyrical"]
STORES: dict[Distribution, Stores] = {name: Stores(f"ros2_{name}") for name in get_args(Distribution)}
NO_HASH = "TypeHashNotSupported"
"""What rmw_zenoh writes in a key where the distribution knows no hashes of types."""
LAST_SECOND = 2**31 - 1
OURS = ("deixis_msgs", "hri_msgs")


class BadCdr(ValueError):
    """Bytes that are not the message that their key says."""


class RosTypes:
    """The types that a distribution ships, and those of `interfaces/`."""

    def __init__(self, distribution: Distribution) -> None:
        self._hashed = distribution != "humble"
        # Of the lists that we read the longest is a picture; the size of the whole message is checked before.
        self._store = get_typestore(STORES[distribution])
        for package in OURS:
            self._store.register(_definitions(package))

    def hash_of(self, type_name: str) -> str:
        """The last part of a topic's key, e.g. `RIHS01_df66...` for `std_msgs/msg/String`."""
        return self._store.hash_rihs01(type_name) if self._hashed else NO_HASH

    def make(self, type_name: str, **fields: Any) -> Any:
        """A message of this type; all fields are needed. Raises TypeError."""
        return self._store.types[type_name](**fields)

    def encode(self, message: Any) -> bytes:
        """CDR, little-endian, with its encapsulation header."""
        return bytes(self._store.serialize_cdr(message, message.__msgtype__, little_endian=True))

    def decode(self, type_name: str, payload: bytes) -> Any:
        """The message in a payload, either byte order; arrays look into the payload. Raises BadCdr."""
        try:
            return self._store.deserialize_cdr(memoryview(payload), type_name)
        except SerdeError as error:
            raise BadCdr(str(error)) from None
        except (IndexError, OverflowError, TypeError) as error:
            raise BadCdr(f"not a {type_name}: {error}") from None

    def header(self, stamp_ns: int, frame_id: str) -> Any:
        """std_msgs/msg/Header."""
        return self.make("std_msgs/msg/Header", stamp=self.time(stamp_ns), frame_id=frame_id)

    def time(self, unix_ns: int) -> Any:
        """builtin_interfaces/msg/Time, which ends in 2038: what is later becomes its last second."""
        seconds, nanoseconds = divmod(unix_ns, 1_000_000_000)
        return self.make("builtin_interfaces/msg/Time", sec=min(seconds, LAST_SECOND), nanosec=nanoseconds)


def stamp_ns(header: Any) -> int:
    """The time in a std_msgs/msg/Header, nanoseconds; before 1970 (which CDR can say) it is 0."""
    return max(0, int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec))


def _definitions(package: str) -> dict[str, Any]:
    folder = resources.files(__package__) / "interfaces" / package / "msg"
    found: dict[str, Any] = {}
    for file in folder.iterdir():
        name = file.name.removesuffix(".msg")
        if name != file.name:
            found.update(get_types_from_msg(file.read_text(encoding="utf-8"), f"{package}/msg/{name}"))
    return found
