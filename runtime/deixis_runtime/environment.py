"""What every process of ours is started with beside what the user has set: by the supervisor, by systemd, in containers."""

from __future__ import annotations

from collections.abc import Mapping

ENVIRONMENT: Mapping[str, str] = {
    # NumPy and OpenCV bring an OpenBLAS each, with a thread for each core and buffers for each thread. Our matrices are small.
    "OPENBLAS_NUM_THREADS": "1",
}
"""The unit of the stages in `systemd/` and the Dockerfile repeat these; a test holds them to it."""
