"""Versions of the distributions installed here: two hosts that differ in them may not understand each other."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

SHARED = ("deixis-schemas", "deixis-runtime", "eclipse-zenoh")


def versions_of(*distributions: str) -> dict[str, str]:
    """Versions by distribution: of what all stages share, and of these as far as they are installed."""
    found = {name: installed(name) for name in (*SHARED, *distributions)}
    return {name: text for name, text in found.items() if text is not None}


def distribution_of(module: str) -> str:
    """The distribution that a module of ours or of a guest comes with: each has one package, named alike."""
    return module.partition(".")[0].replace("_", "-")


def installed(name: str) -> str | None:
    """Version of a distribution; None where it is not installed, as of a stage that somebody runs from a file."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None
