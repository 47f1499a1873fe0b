"""A scene as data: what cannot be rendered is refused by the field's name."""

import pytest

pytest.importorskip("deixis_simulation.scene", reason="deixis-simulation is not installed")

from deixis_simulation.scene import Scene, SceneError, dump_scene, load_scene

PERSON = {"avatar": "White_M_3_Casual", "place_m": [2.0, 0.0]}
POINTING = {"type": "point", "start_s": 1.0, "poi": "a", "arm": "left"}
SCENE = {"duration_s": 4.0, "pois": [{"poi_id": "a", "position_m": [1.0, 1.0, 1.0]}], "people": [PERSON]}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"duration": 3}, "duration: unknown key"),
        ({"room": {"wall_tone": [300, 0, 0]}}, "room.wall_tone.0"),
        ({"room": {"front_x_m": -5}}, "room: front_x_m"),
        ({"people": [PERSON | {"place_m": [20, 0]}]}, "people.0.place_m: .* outside the room"),
        ({"people": [PERSON | {"actions": [POINTING | {"poi": "b"}]}]}, "people.0.actions: no POI 'b'"),
        ({"pois": [SCENE["pois"][0]] * 2}, "poi_id stands twice"),
        ({"robot_path": [{"at_s": 1}, {"at_s": 1}]}, "at_s does not grow"),
    ],
)
def test_what_cannot_be_is_refused_by_name(tmp_path, changed, said):
    import yaml

    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump(SCENE | changed))
    with pytest.raises(SceneError, match=said):
        load_scene(path)


def test_a_scene_is_the_same_after_it_was_written(tmp_path):
    scene = Scene.model_validate(SCENE | {"people": [PERSON | {"actions": [POINTING]}]})
    path = tmp_path / "scene.yaml"
    path.write_text(dump_scene(scene))
    assert load_scene(path) == scene
