"""What `deixis doctor` says of the cameras of this machine: of one source by opening it, else of every device file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from deixis_runtime.finding import Finding
from pydantic import ValidationError

from .capture import source_for
from .config import CameraConfig
from .diagnosis import why_not_openable
from .sources import Picture, PictureRefused, SourceError, device_path, without_credentials

DEVICES = Path("/dev")
ADVICE_DEVICE = "plug it in, end the program that holds it, add the user to the group 'video', or hand it to the container"
ADVICE_SOURCE = "mend the source, or choose another: --set camera.source=..."


def check(source: str | None) -> Iterator[Finding]:
    """Findings about `source` (a device, file, folder or URL) or, without one, about the devices that are here."""
    if source is None:
        yield from check_devices(DEVICES)
    else:
        yield check_source(source)


def check_devices(folder: Path) -> Iterator[Finding]:
    """Each device file of a camera: whether this user may open it. Opening changes nothing, also while another streams."""
    devices = sorted(str(path) for path in folder.glob("video*"))
    if not devices:
        yield Finding("note", f"no camera is plugged in here ({folder}/video*)", "of no matter where the camera runs elsewhere")
    for device in devices:
        why = why_not_openable(device)
        if why is None:
            yield Finding("ok", f"camera device {device} can be opened")
        else:
            yield Finding("wrong", f"camera device {device} {why}", ADVICE_DEVICE)


def check_source(text: str) -> Finding:
    """Open the source, take one picture, and close it."""
    name = without_credentials(text)
    try:
        picture = _first_picture(CameraConfig(source=text))
    except ValidationError as error:
        return Finding("wrong", f"camera source '{name}': {error.errors()[0]['msg']}", ADVICE_SOURCE)
    except (SourceError, PictureRefused) as error:
        return Finding("wrong", str(error), ADVICE_DEVICE if device_path(text) else ADVICE_SOURCE)
    if picture is None:
        return Finding("wrong", f"camera source '{name}' can be opened but holds no picture", ADVICE_SOURCE)
    height, width = picture.image.shape[:2]
    return Finding("ok", f"camera source '{name}' gives pictures: {width} x {height}")


def _first_picture(config: CameraConfig) -> Picture | None:
    source = source_for(config)
    try:
        source.open()
        return source.read()
    finally:
        source.close()
