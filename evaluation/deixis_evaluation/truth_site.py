"""The site file and the camera calibration that belong to a labelled clip, made from its truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from .camera_pose import map_position, mount_of
from .clips import Clip

CALIBRATION_FILE = "camera.yaml"


def site_content(clip: Clip, registry: Path) -> dict[str, Any]:
    """The mapping that a site file for the clip holds. The robot starts at the map's origin; walls are not in the truth."""
    camera = clip.truth.meta.camera
    return {
        "name": f"labelled clip {clip.name}",
        "camera": {
            "source": str(clip.video.resolve()),
            "calibration": CALIBRATION_FILE,
            "mount": mount_of(camera).model_dump(mode="json"),
        },
        "pois": [
            {"poi_id": poi.id, "position_m": [round(value, 6) for value in map_position(camera, poi.xyz_world)]}
            for poi in clip.truth.meta.pois
        ],
        "settings": {"fusion": {"registry": str(registry)}},
    }


def calibration_content(clip: Clip) -> dict[str, Any]:
    """A ROS camera_info mapping with the clip's intrinsics."""
    meta = clip.truth.meta
    distortion = list(meta.camera.dist) or [0.0] * 5
    projection = [value for row in meta.camera.K for value in (*row, 0.0)]
    return {
        "image_width": meta.width,
        "image_height": meta.height,
        "camera_name": clip.name,
        "camera_matrix": {"rows": 3, "cols": 3, "data": list(meta.camera.matrix)},
        "distortion_model": meta.camera.distortion_model,
        "distortion_coefficients": {"rows": 1, "cols": len(distortion), "data": distortion},
        "rectification_matrix": {"rows": 3, "cols": 3, "data": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]},
        "projection_matrix": {"rows": 3, "cols": 4, "data": projection},
    }


def write_site(clip: Clip, folder: Path) -> Path:
    """Write site file, calibration and the place of a fresh POI registry into `folder`. Returns the site file."""
    (folder / CALIBRATION_FILE).write_text(yaml.safe_dump(calibration_content(clip)), encoding="utf-8")
    site = folder / "site.yaml"
    site.write_text(yaml.safe_dump(site_content(clip, folder / "pois.sqlite")), encoding="utf-8")
    return site
