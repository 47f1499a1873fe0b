"""Frames into an MP4 file (H.264, as cameras and phones write it)."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from numpy.typing import NDArray


class EncodeError(OSError):
    """A film that cannot be written; the text names the file and the cause."""


class Encoder:
    """Writes one film; frame i given is frame i of the file. Use as a context manager."""

    def __init__(self, path: Path, width: int, height: int, fps: int, crf: float) -> None:
        """`crf`: x264's rate factor, more is coarser. Raises EncodeError."""
        self._path = path
        try:
            path.open("wb").close()  # FFmpeg opens it with the first frame only
            # Faststart: a player that streams the file has the index first.
            self._file = av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"})
            # One thread: the bytes must not depend on the number of cores. No macroblock tree, which cameras do without, too:
            # with it, the same pictures gave other bytes in other processes.
            self._stream = self._file.add_stream(
                "libx264", rate=fps, options={"crf": f"{crf:g}", "preset": "medium", "threads": "1", "x264-params": "mbtree=0"}
            )
        except (OSError, ValueError) as error:
            raise EncodeError(f"film '{path}' cannot be written: {error}") from None
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"

    def __enter__(self) -> Self:
        return self

    def write(self, picture: NDArray[np.uint8]) -> None:
        """Append a frame (h, w, 3) BGR. Raises EncodeError."""
        try:
            for packet in self._stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")):
                self._file.mux(packet)
        except (OSError, ValueError) as error:
            raise EncodeError(f"film '{self._path}' cannot be written: {error}") from None

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Finish the file. Raises EncodeError."""
        try:
            if kind is None:
                for packet in self._stream.encode(None):
                    self._file.mux(packet)
            self._file.close()
        except (OSError, ValueError) as fault:
            raise EncodeError(f"film '{self._path}' cannot be written: {fault}") from None
