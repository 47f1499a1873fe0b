"""Messages, topics and codec of Deixis. Depends on pydantic and msgpack only, never on a transport."""

from .messages import Producer

__all__ = ["Producer"]
