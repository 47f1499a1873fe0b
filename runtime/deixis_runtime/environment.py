"""What every process of ours is started with beside what the user has set: by the supervisor, by systemd, in containers."""

from __future__ import annotations

from collections.abc import Mapping

ENVIRONMENT: Mapping[str, str] = {
    # NumPy and OpenCV bring an OpenBLAS each, with a thread for each core and buffers for each thread. Our matrices are small.
    "OPENBLAS_NUM_THREADS": "1",
    # One heap: each thread that allocates gets one of its own otherwise, and keeps what it once needed (camera: 5 MB less).
    "MALLOC_ARENA_MAX": "1",
    # Pictures come and go with each frame. Where malloc gives such blocks back at once the next frame has them anew, page by
    # page: 300 page faults a frame, a millisecond in all; kept, they are 10 MB in all.
    "MALLOC_MMAP_THRESHOLD_": "67108864",
    "MALLOC_TRIM_THRESHOLD_": "134217728",
}
"""The unit of the stages in `systemd/` and the Dockerfile repeat these; a test holds them to it."""
