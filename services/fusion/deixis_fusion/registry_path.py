"""Where the registry's file is when no setting says so."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path


def default_registry_path(robot: str, site: Path) -> Path:
    """One file for each robot and site file, in the user's state folder (XDG base directories)."""
    base = os.environ.get("XDG_STATE_HOME") or ""
    state = Path(base) if os.path.isabs(base) else Path.home() / ".local" / "state"
    resolved = site.resolve()
    digest = hashlib.sha256(str(resolved).encode()).hexdigest()[:8]
    return state / "deixis" / robot / f"{resolved.stem}-{digest}.sqlite"
