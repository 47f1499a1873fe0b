import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from deixis_camera.calibration import load_calibration
from deixis_evaluation.camera_pose import map_position, mount_of, path_of
from deixis_evaluation.clips import Clip, ClipError, TrueView, Truth, load_clips, load_truth
from deixis_evaluation.truth_site import write_site
from deixis_runtime.mount import to_base
from deixis_runtime.site import load_site
from hypothesis import given
from hypothesis import strategies as st
from labelled_views import turned_view

PITCH = 0.1
LEVEL = [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]


def label() -> dict[str, Any]:
    """A room of one POI with a camera 2 m in front of the person, 1.3 m high, level."""
    return {
        "meta": {
            "kind": "point",
            "fps": 30,
            "width": 640,
            "height": 480,
            "camera": {
                "K": [[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]],
                "dist": [0, 0, 0, 0, 0],
                "R_world_to_cam": LEVEL,
                "t_world_to_cam": [0, 1.3, 2.0],
                "height_m": 1.3,
                "pitch_up_deg": 0.0,
            },
            "pois": [{"id": "P1", "xyz_world": [1.0, 1.2, 0.5]}],
        },
        "frames": [{"frame": 0, "persons": [person()]}],
    }


def person() -> dict[str, Any]:
    hand = {"center_px": [300, 400], "centroid_visible_px": [300, 400], "visible_px": 400, "in_frame": True}
    return {
        "id": 0,
        "phase": "none",
        "gesture": "none",
        "head": {"yaw_rel_deg": 0, "center_px": [320, 200]},
        "face": {"bbox_visible": [300, 180, 40, 50], "centroid_visible_px": [320, 205], "visible_px": 1500},
        "hands": {"left": hand, "right": hand},
        "user_pos": {"robot_xy": [2.0, 0.0], "distance_m": 2.0},
    }


def write(folder: Path, name: str, content: object) -> Path:
    (folder / f"{name}.mp4").write_bytes(b"")
    path = folder / f"{name}.json"
    path.write_text(json.dumps(content))
    return path


def test_clips_are_loaded_by_name_and_glob(tmp_path: Path) -> None:
    for name in ("b", "a", "c1"):
        write(tmp_path, name, label())
    assert [clip.name for clip in load_clips(tmp_path)] == ["a", "b", "c1"]
    assert [clip.name for clip in load_clips(tmp_path, "c*")] == ["c1"]


def test_a_missing_folder_an_empty_one_and_a_glob_without_clips_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ClipError, match="is not a folder"):
        load_clips(tmp_path / "nowhere")
    with pytest.raises(ClipError, match="holds no clips"):
        load_clips(tmp_path)
    write(tmp_path, "a", label())
    with pytest.raises(ClipError, match=r"no clip named z\*"):
        load_clips(tmp_path, "z*")


def test_a_video_without_labels_is_named(tmp_path: Path) -> None:
    (tmp_path / "lonely.mp4").write_bytes(b"")
    with pytest.raises(ClipError, match=r"no label file lonely\.json"):
        load_clips(tmp_path)


def _set(content: Any, path: list[Any], value: Any) -> None:
    for part in path[:-1]:
        content = content[part]
    content[path[-1]] = value


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (["meta", "camera", "K"], [[0, 0, 1], [0, 1, 1], [0, 0, 1]], r"meta\.camera: K: focal"),
        (["meta", "camera", "R_world_to_cam"], [1, 2], r"meta\.camera\.R_world_to_cam"),
        (["meta", "camera", "R_world_to_cam"], [1, 0, 0, 0, 0, 1, 0, 1, 0], "no forward direction"),
        (["meta", "fps"], 0, r"meta\.fps"),
        (["meta", "pois", 0, "xyz_world"], [0, float("nan"), 0], r"meta\.pois\.0\.xyz_world"),
        (["meta", "pois", 0, "id"], "no/slash", r"meta\.pois\.0\.id"),
        (["frames"], [], r"frames"),
        (["frames", 0, "frame"], 3, r"frames\.0\.frame: is 3"),
        (["frames", 0, "persons", 0, "head"], {}, r"frames\.0\.persons\.0\.head\.yaw_rel_deg"),
        (["frames", 0, "persons", 0, "phase"], "waving", r"frames\.0\.persons\.0\.phase"),
    ],
)
def test_a_bad_label_names_file_and_field(tmp_path: Path, path: list[Any], value: Any, named: str) -> None:
    content = label()
    _set(content, path, value)
    with pytest.raises(ClipError, match=named) as caught:
        load_truth(write(tmp_path, "bad", content))
    assert "bad.json" in str(caught.value)


def test_a_stroke_at_an_unknown_poi_is_refused(tmp_path: Path) -> None:
    content = label()
    content["frames"][0]["persons"][0] |= {"phase": "stroke", "gesture": "point", "poi": "P9", "poi_azimuth_deg": 10}
    with pytest.raises(ClipError, match="poi 'P9' is not in"):
        load_truth(write(tmp_path, "bad", content))


def test_label_files_that_are_not_json_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "bad", label())
    path.write_bytes(b"\xff\x00{")
    with pytest.raises(ClipError, match=r"bad\.json' is not JSON"):
        load_truth(path)


def test_poi_positions_are_forward_left_and_up_from_the_cameras_foot() -> None:
    camera = Truth.model_validate(label()).meta.camera
    # World: x to the image's right, y up, z toward the camera, which stands at z = 2.
    assert map_position(camera, (0.7, 1.1, -1.0)) == pytest.approx((3.0, -0.7, 1.1))


def test_a_tilted_and_turned_camera_still_gives_a_level_map() -> None:
    content = label()
    turn, tilt = np.radians(90), PITCH
    look = np.array([np.sin(turn) * np.cos(tilt), np.sin(tilt), -np.cos(turn) * np.cos(tilt)])
    right = np.cross(look, [0, 1, 0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(look, right), look])
    centre = np.array([0.0, 1.3, 2.0])
    content["meta"]["camera"] |= {
        "R_world_to_cam": rotation.ravel().tolist(),
        "t_world_to_cam": (-rotation @ centre).tolist(),
    }
    camera = Truth.model_validate(content).meta.camera
    # It looks along the world's +x, so ahead is +x and left is -z, which is away from the old camera place.
    assert map_position(camera, (3.0, 0.4, 1.0)) == pytest.approx((3.0, 1.0, 0.4))


def test_the_site_of_a_clip_is_one_that_the_stages_accept(tmp_path: Path) -> None:
    clip = Clip("a", tmp_path / "a.mp4", Truth.model_validate(label()))
    site = load_site(write_site(clip, tmp_path))
    assert site.camera["mount"] == {"position_m": [0.0, 0.0, 1.3], "yaw_deg": 0.0, "pitch_up_deg": 0.0, "roll_deg": 0.0}
    assert site.pois[0].position_m == pytest.approx((1.5, -1.0, 1.2))
    calibration = load_calibration(tmp_path / site.camera["calibration"])
    assert calibration.camera_matrix == (500, 0, 319.5, 0, 500, 239.5, 0, 0, 1)
    assert site.settings["fusion"]["registry"].startswith(str(tmp_path))
    assert yaml.safe_load((tmp_path / "camera.yaml").read_text())["image_width"] == 640


@given(st.floats(-170, 170), st.floats(-60, 60), st.floats(-45, 45))
def test_the_mount_is_read_from_the_rotation_and_is_the_one_that_fusion_undoes(yaw: float, pitch: float, roll: float) -> None:
    view = TrueView.model_validate(turned_view(yaw, pitch, roll, (0.3, 1.3, 2.0)))
    mount = mount_of(view)
    assert (mount.pitch_up_deg, mount.roll_deg) == pytest.approx((pitch, roll), abs=1e-4)
    assert mount.position_m == pytest.approx((0, 0, 1.3))
    point = np.array([0.4, 1.9, -1.1])
    optical = view.rotation @ (point - view.centre)
    x, y, z = to_base((float(optical[0]), float(optical[1]), float(optical[2])), mount)
    assert (x, y, z + 1.3) == pytest.approx(map_position(view, (0.4, 1.9, -1.1)), abs=1e-5)


def moving(*views: dict[str, Any]) -> dict[str, Any]:
    content = label()
    content["meta"]["camera"] |= views[0]
    content["frames"] = [{"frame": i, "persons": [], "camera": view} for i, view in enumerate(views)]
    return content


def test_a_camera_that_drives_and_turns_is_a_robot_that_does() -> None:
    start = turned_view(0, 3, 2, (0, 1.3, 2.0))
    # 1 m ahead (the world's -z), 0.5 m to the left (-x), turned 30 degrees to the left.
    path = path_of(Truth.model_validate(moving(start, turned_view(30, 3, 2, (-0.5, 1.3, 1.0)))))
    assert (path[0].x_m, path[0].y_m, path[0].yaw_deg) == pytest.approx((0, 0, 0))
    assert (path[1].x_m, path[1].y_m, path[1].yaw_deg) == pytest.approx((1.0, 0.5, 30))
    assert path_of(Truth.model_validate(label())) == []


def test_a_moving_camera_that_tilts_or_is_not_labelled_throughout_is_refused() -> None:
    start = turned_view(0, 3, 2, (0, 1.3, 2.0))
    with pytest.raises(ClipError, match=r"frames\.1\.camera: tilted"):
        path_of(Truth.model_validate(moving(start, turned_view(0, 8, 2, (0, 1.3, 2.0)))))
    content = moving(start, start)
    del content["frames"][1]["camera"]
    with pytest.raises(ValueError, match=r"frames\.1\.camera: missing"):
        Truth.model_validate(content)
    with pytest.raises(ValueError, match="not a rotation"):
        TrueView.model_validate(start | {"R_world_to_cam": [1, 0, 0, 0, 1, 0, 0, 0, 2]})
