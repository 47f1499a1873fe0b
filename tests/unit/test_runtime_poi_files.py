"""POIs from files: site files, lists, CSV and GeoJSON, and what is refused of them."""

import json
from pathlib import Path

import pytest
from deixis_runtime.poi_files import load_pois
from deixis_runtime.site import SiteError

CSV = """poi_id,name,x_m,y_m,z_m,extent_m,tags
vase,"the vase, blue",1,-2.5,1.2,0.3,ceramics; blue
door,,4,0,1,,
"""


def feature(poi_id="vase", place=(1, -2.5, 1.2), kind="Point", **properties):
    return {"type": "Feature", "id": poi_id, "geometry": {"type": kind, "coordinates": place}, "properties": properties}


def collection(*features, **more):
    return {"type": "FeatureCollection", "features": features} | more


def file(tmp_path: Path, name: str, content) -> Path:
    path = tmp_path / name
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def said(path: Path) -> dict:
    return {poi.poi_id: (poi.name, poi.position_m, poi.extent_m, poi.tags) for poi in load_pois(path)}


WANTED = {"vase": ("the vase, blue", (1, -2.5, 1.2), 0.3, ["ceramics", "blue"]), "door": ("", (4, 0, 1), 0.5, [])}


def test_csv_is_read_by_its_header(tmp_path):
    assert said(file(tmp_path, "a.csv", CSV)) == WANTED
    assert said(file(tmp_path, "b.CSV", "\ufeff" + CSV.replace("\n", "\r\n"))) == WANTED


def test_a_cell_of_csv_of_several_lines_is_one_line(tmp_path):
    for end in ("\n", "\r\n"):
        rows = ["poi_id,name,x_m,y_m,z_m", 'vase,"the vase,', 'blue",1,2,3', "door,a\u2028b,4,0,1", ""]
        read = said(file(tmp_path, "a.csv", end.join(rows)))
        assert [name for name, *_ in read.values()] == ["the vase, blue", "a b"]


@pytest.mark.parametrize("name", ["a.geojson", "a.json"])
def test_geojson_points_are_metres_in_the_map(tmp_path, name):
    vase = feature(name="the vase, blue", extent_m=0.3, tags=["ceramics", "blue"], colour="of some other tool")
    door = feature(None, (4, 0, 1))
    door["properties"] = {"poi_id": "door"}
    assert said(file(tmp_path, name, collection(vase, door))) == WANTED


def test_a_list_and_a_site_file_are_read_as_before(tmp_path):
    listed = "- {poi_id: sofa, position_m: [1, 1, 0]}\n"
    assert list(said(file(tmp_path, "a.yaml", listed))) == ["sofa"]
    assert list(said(file(tmp_path, "b.yaml", "pois:\n" + listed))) == ["sofa"]
    assert said(file(tmp_path, "c.yaml", "")) == {}


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("poi_id,x_m,y_m\nvase,1,2\n", "no column 'z_m'"),
        ("", "no column 'poi_id'"),
        ("poi_id;x_m;y_m;z_m\nvase;1;2;3\n", "no column 'poi_id'.*parted by commas"),
        ("poi_id,x_m,y_m,z_m,colour\n", "column 'colour' is unknown"),
        ("poi_id,x_m,y_m,z_m,x_m\n", "column 'x_m' is unknown or stands twice"),
        ("poi_id,x_m,y_m,z_m\nvase,1,2,high\n", "line 2: z_m: 'high' is not a number"),
        ("poi_id,x_m,y_m,z_m\nvase,1,2,\n", "line 2: z_m: '' is not a number"),
        ("poi_id,x_m,y_m,z_m\na,1,2,3\nb,1,2\n", "line 3: not as many cells"),
        ("poi_id,x_m,y_m,z_m\na,1,2,3,4\n", "line 2: not as many cells"),
        ("poi_id,x_m,y_m,z_m\na,1,2,inf\n", r"pois\.0\.position_m\.2"),
        ("poi_id,x_m,y_m,z_m\ntwo words,1,2,3\n", r"pois\.0\.poi_id"),
        ("poi_id,x_m,y_m,z_m\na,1,2,3\na,1,2,3\n", "poi_id 'a' stands twice"),
    ],
)
def test_what_is_wrong_in_csv_is_named(tmp_path, content, complaint):
    with pytest.raises(SiteError, match=complaint) as error:
        load_pois(file(tmp_path, "a.csv", content))
    assert "a.csv" in str(error.value)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (collection(feature(), feature("b", kind="Polygon")), "feature 1: geometry Polygon"),
        (collection(feature(place=(24.9, 60.2))), "feature 0: coordinates: x, y and z"),
        (collection(feature(), crs={"properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}), "crs: coordinates are metres"),
        (collection({"type": "Feature", "geometry": None}), "feature 0: not a Feature with a geometry"),
        (collection(feature(None)), r"pois\.0\.poi_id"),
        (collection(feature(extent_m=-1)), r"pois\.0\.extent_m"),
        ({"type": "Point"}, "not a GeoJSON FeatureCollection"),
        ({"type": "FeatureCollection"}, "not a GeoJSON FeatureCollection"),
        ("{", "not JSON"),
    ],
)
def test_what_is_wrong_in_geojson_is_named(tmp_path, content, complaint):
    with pytest.raises(SiteError, match=complaint):
        load_pois(file(tmp_path, "a.geojson", content))


def test_a_file_that_is_not_there_or_no_text_is_named(tmp_path):
    with pytest.raises(SiteError, match=r"none\.csv: No such file"):
        load_pois(tmp_path / "none.csv")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SiteError, match=r"b\.csv: not UTF-8"):
        load_pois(tmp_path / "b.csv")


def test_the_example_that_the_readme_imports_can_be_read():
    pois = load_pois(Path(__file__).parents[2] / "examples" / "exhibits.csv")
    assert [(poi.poi_id, poi.tags) for poi in pois] == [("lamp", []), ("chart", ["paper", "maps"]), ("anchor", ["iron"])]


@pytest.mark.parametrize("bad", ["\x1b", "\x00", "\u202e", "\n"])
@pytest.mark.parametrize("kind", ["a.yaml", "b.json", "c.geojson", "d.csv", "e.yaml"])
@pytest.mark.parametrize("field", ["name", "tags", "poi_id"])
def test_control_characters_are_refused_with_file_and_field(tmp_path, bad, kind, field):
    text = f"ab{bad}c"
    told = {"poi_id": "vase", "name": "Vase", "tags": ["blue"]} | {field: ["blue", text] if field == "tags" else text}
    content = {
        "a.yaml": [told | {"position_m": [1, 2, 3]}],
        "b.json": [told | {"position_m": [1, 2, 3]}],
        "c.geojson": collection(feature(place=(1, 2, 3)) | {"properties": told}),
        "d.csv": f'poi_id,name,tags,x_m,y_m,z_m\n"{told["poi_id"]}","{told["name"]}","{";".join(told["tags"])}",1,2,3\n',
        "e.yaml": {"pois": [told | {"position_m": [1, 2, 3]}]},
    }[kind]
    path = file(tmp_path, kind, content)
    if kind == "d.csv" and bad == "\n" and field != "poi_id":
        # A cell of several lines is read as one.
        assert "ab c" in str(said(path))
        return
    with pytest.raises(SiteError, match=rf"{kind}.*{field}") as refused:
        load_pois(path)
    assert bad not in str(refused.value)
