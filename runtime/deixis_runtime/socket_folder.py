"""The temporary folder in which a supervisor keeps its sockets, and who removes it when the supervisor cannot."""

from __future__ import annotations

import shutil
from pathlib import Path

PREFIX = "deixis-"
UNIX = "unixsock-stream/"


def remove_socket_folder(endpoint: str) -> None:
    """Remove the folder that this endpoint lies in, if a supervisor made it: for its children, when it was killed."""
    folder = Path(endpoint.removeprefix(UNIX)).parent
    if endpoint.startswith(UNIX) and folder.name.startswith(PREFIX):
        shutil.rmtree(folder, ignore_errors=True)  # all of them try
