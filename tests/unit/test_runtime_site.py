"""A site file is read whole or refused with the field's name."""

import pytest
from deixis_runtime.site import SiteError, load_site

GOOD = """
name: hall
pois:
  - {poi_id: vase, position_m: [1, 2, 3]}
  - {poi_id: door, position_m: [1, -2, 1], extent_m: 1.0}
walls: [[[0, 0], [1, 0]]]
settings: {tracker: {anything: 3}}
"""


def load(tmp_path, text):
    path = tmp_path / "site.yaml"
    path.write_text(text)
    return load_site(path)


def test_a_site_is_read(tmp_path):
    site = load(tmp_path, GOOD)
    assert [poi.poi_id for poi in site.pois] == ["vase", "door"]
    assert site.walls == [((0.0, 0.0), (1.0, 0.0))]
    assert site.settings == {"tracker": {"anything": 3}}
    assert site.path == (tmp_path / "site.yaml").resolve()


def test_an_empty_site_is_a_site(tmp_path):
    assert load(tmp_path, "").pois == []


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("colour: red", "colour"),
        ("path: /etc", "path: unknown key"),
        ("pois: [{poi_id: a, position_m: [1, 2, 3], positoin: 1}]", "pois.0.positoin"),
        ("pois: [{poi_id: a, position_m: [.nan, 2, 3]}]", "pois.0.position_m.0"),
        ("pois: [{poi_id: a, position_m: [1, 2]}]", "pois.0.position_m"),
        ("pois: [{poi_id: a, position_m: [1,2,3]}, {poi_id: a, position_m: [1,2,3]}]", "poi_id 'a' stands twice"),
        ("walls: [[[0, 0], [.inf, 1]]]", "walls.0.1.0"),
        ("robot_pose: {x_m: 1, z_m: 2}", "robot_pose.z_m"),
        ("- a list", "not a mapping"),
        ("a: [", "not YAML"),
        # libyaml's own way to nodes ends the process by these.
        ("a: " + "[" * 100_000 + "]" * 100_000, "nested more than 100 deep"),
        ("- " * 50_000 + "a", "nested more than 100 deep"),
    ],
)
def test_a_bad_site_names_the_field(tmp_path, text, named):
    with pytest.raises(SiteError, match=named.replace("[", r"\[")) as caught:
        load(tmp_path, text)
    assert "site.yaml" in str(caught.value)


def test_a_missing_site_names_the_file(tmp_path):
    with pytest.raises(SiteError, match=r"nowhere\.yaml: No such file"):
        load_site(tmp_path / "nowhere.yaml")


def test_bytes_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "site.yaml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SiteError, match="not YAML"):
        load_site(path)
