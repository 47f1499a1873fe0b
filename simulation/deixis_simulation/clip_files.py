"""The files of a clip: NAME.mp4, NAME.json, NAME_labels.npz. The JSON comes last, so that what has one is whole."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from .label_image import Labels
from .scene import Scene
from .truth_meta import generator


@dataclass(frozen=True)
class ClipFiles:
    """Names of a clip's files in a folder."""

    folder: Path
    name: str

    @property
    def video(self) -> Path:
        """The film."""
        return self.folder / f"{self.name}.mp4"

    @property
    def truth(self) -> Path:
        """The labels."""
        return self.folder / f"{self.name}.json"

    @property
    def pictures(self) -> Path:
        """The label images."""
        return self.folder / f"{self.name}_labels.npz"


def is_finished(scene: Scene, folder: Path, *, labels: bool) -> bool:
    """Whether the clip of this very scene is there, by this version of the renderer."""
    files = ClipFiles(folder, scene.name)
    if not files.video.is_file() or files.video.stat().st_size == 0 or (labels and not files.pictures.is_file()):
        return False
    try:
        meta = json.loads(files.truth.read_text(encoding="utf-8"))["meta"]
        return bool(meta["scene"] == scene.model_dump(mode="json") and meta["generator"] == generator())
    except (OSError, ValueError, KeyError, TypeError):
        return False


def write_truth(path: Path, meta: dict[str, Any], frames: list[dict[str, Any]]) -> None:
    """Write labels as JSON, a frame a line."""
    lines = ",\n".join(json.dumps(frame, separators=(",", ":"), allow_nan=False) for frame in frames)
    content = json.dumps(meta, separators=(",", ":"), allow_nan=False)
    path.write_text(f'{{"meta":{content},\n"frames":[\n{lines}\n]}}\n', encoding="utf-8")


def packed(labels: Labels) -> NDArray[np.uint8]:
    """A label image as the bytes of a PNG."""
    done, data = cv2.imencode(".png", labels, [cv2.IMWRITE_PNG_COMPRESSION, 6])
    if not done:
        raise ValueError("a label image could not be packed")
    return np.asarray(data, np.uint8).ravel()


def write_pictures(path: Path, images: list[NDArray[np.uint8]]) -> None:
    """Write packed label images as f0000, f0001, ..."""
    named = {f"f{number:04d}": image for number, image in enumerate(images)}
    np.savez(path, allow_pickle=False, **named)


def publish(made: ClipFiles, folder: Path) -> None:
    """Move a clip's files to where they are looked for; an old clip of that name is none from the first move on."""
    there = ClipFiles(folder, made.name)
    there.truth.unlink(missing_ok=True)
    there.pictures.unlink(missing_ok=True)
    if made.pictures.exists():
        made.pictures.replace(there.pictures)
    made.video.replace(there.video)
    made.truth.replace(there.truth)
