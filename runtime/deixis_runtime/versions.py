"""Versions of the distributions installed here: two hosts that differ in them may not understand each other."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

SHARED = ("deixis-schemas", "deixis-runtime", "eclipse-zenoh")


def versions_of(*stages: str) -> dict[str, str]:
    """Versions by distribution: of what all stages share, and of the distributions of these stages as far as there are any."""
    found = {name: installed(name) for name in (*SHARED, *(f"deixis-{stage}" for stage in stages))}
    return {name: text for name, text in found.items() if text is not None}


def installed(name: str) -> str | None:
    """Version of a distribution; None where it is not installed, as of a stage that somebody runs from a file."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None
