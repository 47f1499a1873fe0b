"""Arrows point down: calibration, cli, conformance, view, evaluation, simulation -> services -> runtime -> schemas.

No service imports another. A bridge stands where a service does.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SERVICES = ("camera", "tracker", "headpose", "gesture", "fusion")
MAY_IMPORT = {
    "deixis_schemas": set(),
    "deixis_runtime": {"deixis_schemas"},
    **{f"deixis_{name}": {"deixis_schemas", "deixis_runtime"} for name in SERVICES},
    "deixis_cli": {"deixis_schemas", "deixis_runtime"},
    "deixis_ros2": {"deixis_schemas", "deixis_runtime"},
    "deixis_view": {"deixis_schemas", "deixis_runtime", "deixis_cli"},
    "deixis_calibration": {
        *("deixis_schemas", "deixis_runtime", "deixis_cli"),
        # It reads pictures as the camera does, writes what the camera reads, shows what the tracker sees, and asks fusion.
        *("deixis_camera", "deixis_tracker", "deixis_fusion"),
    },
    "deixis_conformance": {"deixis_schemas", "deixis_runtime", "deixis_cli"},
    "deixis_evaluation": {"deixis_schemas", "deixis_runtime", "deixis_cli", *(f"deixis_{name}" for name in SERVICES)},
    **{f"deixis_{name}_mediapipe": {"deixis_schemas", "deixis_runtime"} for name in ("tracker", "headpose", "gesture")},
    "deixis_simulation": {
        *("deixis_schemas", "deixis_runtime", "deixis_cli"),
        # A rehearsal plays a site's clips and scores the answers, and says what the stages' settings allow.
        *("deixis_camera", "deixis_headpose", "deixis_fusion", "deixis_evaluation"),
    },
}


def package_folder(package):
    return next(path for path in ROOT.glob(f"**/{package}") if ".venv" not in path.parts and (path / "__init__.py").exists())


def imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield (node.module or "").split(".")[0]


@pytest.mark.parametrize("package", sorted(MAY_IMPORT))
def test_a_package_imports_only_what_lies_below(package):
    for path in package_folder(package).rglob("*.py"):
        ours = {name for name in imported(path) if name.startswith("deixis_")}
        assert ours <= MAY_IMPORT[package] | {package}, f"{path.relative_to(ROOT)} imports {ours}"


@pytest.mark.parametrize("stage", SERVICES)
def test_cores_know_no_transport(stage):
    for path in package_folder(f"deixis_{stage}").rglob("*.py"):
        assert "zenoh" not in set(imported(path)), path
