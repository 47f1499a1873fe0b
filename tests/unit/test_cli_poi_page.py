"""The page of `deixis poi edit`: who may ask, what is read of a request, and what an edit comes to."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from deixis_cli.main import main
from deixis_cli.options import CommandError
from deixis_cli.poi_link import Snapshot
from deixis_cli.poi_map import MAX_PICTURE_SIDE, SiteMap, site_map
from deixis_cli.poi_registry import EditRefused, NoAnswer
from deixis_cli.poi_requests import MAX_BODY_BYTES, Page, Request
from deixis_cli.poi_server import host_names, page_files
from deixis_runtime.site import load_site
from deixis_schemas.messages import Poi

HOST = "127.0.0.1:8080"
ASKER = {"host": HOST, "x-deixis-token": "secret"}
EDITOR = {**ASKER, "origin": f"http://{HOST}", "sec-fetch-site": "same-origin", "content-type": "application/json"}
VASE = {"name": "the vase", "position_m": [1, -2.5, 0.75], "extent_m": 0.3, "tags": ["blue"]}


class Store:
    """A registry in memory, which stamps as fusion does."""

    def __init__(self):
        self.pois = {"lamp": Poi(poi_id="lamp", position_m=(0, 0, 1))}
        self.silent = ""

    def snapshot(self):
        return Snapshot(str(len(self.pois)), self.pois, None, self.silent)

    def add(self, poi):
        if poi.poi_id in self.pois:
            raise EditRefused(f"poi_id: there is a POI '{poi.poi_id}' already")
        return self.put(poi)

    def put(self, poi):
        if self.silent:
            raise NoAnswer(self.silent)
        self.pois[poi.poi_id] = poi.model_copy(update={"edited_by": "anna", "edited_ns": 7})
        return self.pois[poi.poi_id]

    def delete(self, poi_id):
        if poi_id not in self.pois:
            raise EditRefused(f"poi_id: there is no POI '{poi_id}'")
        return self.pois.pop(poi_id)


@pytest.fixture
def store():
    return Store()


@pytest.fixture
def page(store):
    return Page("secret", frozenset({HOST}), "r1", "anna", SiteMap("hall", picture=b"png"), store, page_files())


def asked(page, method, target, content=None, headers=EDITOR):
    body = content if isinstance(content, bytes) else b"" if content is None else json.dumps(content).encode()
    reply = page.answer(Request(method, target, headers, body))
    return reply.status, json.loads(reply.body) if reply.content_type == "application/json" else reply.body


def test_a_put_is_answered_with_what_was_stored_and_by_whom(page, store):
    status, said = asked(page, "PUT", "/api/pois/vase", VASE)
    assert (status, said["poi"]) == (200, {**VASE, "poi_id": "vase", "edited_by": "anna", "edited_ns": 7})
    assert store.pois["vase"].position_m == (1, -2.5, 0.75)


def test_a_new_poi_does_not_replace_one_of_its_id(page, store):
    status, said = asked(page, "PUT", "/api/pois/lamp?new=1", VASE)
    assert (status, said) == (409, {"error": "poi_id: there is a POI 'lamp' already", "field": "poi_id"})
    assert store.pois["lamp"].name == ""


def test_a_delete_is_answered_with_the_poi_as_it_was(page, store):
    assert asked(page, "DELETE", "/api/pois/lamp")[1]["poi"]["position_m"] == [0, 0, 1]
    assert store.pois == {}
    assert asked(page, "DELETE", "/api/pois/lamp") == (409, {"error": "poi_id: there is no POI 'lamp'", "field": "poi_id"})


@pytest.mark.parametrize(
    ("content", "status", "field"),
    [
        (b'{"name": ', 400, ""),
        (b"\xff\xfe", 400, ""),
        (b"[1, 2]", 400, ""),
        (b" " * (MAX_BODY_BYTES + 1), 413, ""),
        ({**VASE, "position_m": [1, None, 0]}, 400, "position_m.1"),
        ({**VASE, "position_m": [1, 2]}, 400, "position_m.2"),
        (b'{"position_m": [1, NaN, 0]}', 400, "position_m.1"),
        ({**VASE, "extent_m": -1}, 400, "extent_m"),
        ({**VASE, "name": "two\nlines"}, 400, "name"),
        ({**VASE, "tags": ["x" * 65]}, 400, "tags.0"),
        ({**VASE, "poi_id": "other"}, 400, "poi_id"),
        ({**VASE, "edited_by": "somebody else"}, 400, ""),
    ],
)
def test_what_breaks_the_contract_is_refused_with_the_fields_name_and_stores_nothing(page, store, content, status, field):
    before = dict(store.pois)
    got, said = asked(page, "PUT", "/api/pois/vase", content)
    assert (got, said["field"]) == (status, field), said
    assert said["error"]
    assert store.pois == before


@pytest.mark.parametrize("poi_id", ["", "a%2Fb", "*", "..", "a%20b", "a%3Fop%3Ddelete", "x" * 65, "%ff"])
@pytest.mark.parametrize("method", ["PUT", "DELETE"])
def test_an_id_that_is_no_part_of_a_key_is_refused(page, store, method, poi_id):
    status, said = asked(page, method, f"/api/pois/{poi_id}", VASE if method == "PUT" else None)
    assert (status, said["field"]) == (400, "poi_id")
    assert set(store.pois) == {"lamp"}


@pytest.mark.parametrize(
    "wrong",
    [
        {"x-deixis-token": "guess"},
        {"x-deixis-token": ""},
        {"x-deixis-token": "sécret"},
        {"host": "evil.example:8080"},
        {"host": ""},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": f"https://{HOST}"},
        {"sec-fetch-site": "cross-site"},
    ],
)
@pytest.mark.parametrize(("method", "target"), [("PUT", "/api/pois/lamp"), ("DELETE", "/api/pois/lamp"), ("GET", "/api/live")])
def test_another_sites_page_and_who_does_not_know_the_token_are_refused(page, store, method, target, wrong):
    status, said = asked(page, method, target, VASE if method == "PUT" else None, {**EDITOR, **wrong})
    assert status == 403
    assert "pois" not in said
    assert store.pois["lamp"].name == ""


def test_a_form_of_another_kind_than_json_is_refused(page):
    assert asked(page, "PUT", "/api/pois/vase", VASE, {**EDITOR, "content-type": "text/plain"})[0] == 415
    assert asked(page, "POST", "/api/pois/vase", VASE)[0] == 405
    assert asked(page, "PUT", "/api/site", VASE)[0] == 404
    for target in ("/api/nothing", "/../poi.py", "//etc/passwd", "/poi_page/page.js"):
        assert asked(page, "GET", target)[0] == 404, target


def test_pois_are_sent_when_they_have_changed_and_trouble_is_told(page, store):
    status, said = asked(page, "GET", "/api/live?version=")
    assert (status, [poi["poi_id"] for poi in said["pois"]], said["trouble"]) == (200, ["lamp"], "")
    store.silent = "the router at tcp/x is gone; waiting for it"
    _, said = asked(page, "GET", f"/api/live?version={said['version']}")
    assert ("pois" in said, said["trouble"]) == (False, store.silent)
    assert asked(page, "PUT", "/api/pois/vase", VASE) == (503, {"error": store.silent, "field": ""})


def test_the_pages_files_need_no_token_and_name_no_other_host(page):
    for target in ("/", "/page.js", "/page.css", "/view.js"):
        status, body = asked(page, "GET", target, headers={"host": HOST})
        assert status == 200
        assert b"http://" not in body
        assert b"https://" not in body
    assert asked(page, "GET", "/api/map.png") == (200, b"png")
    assert asked(replace(page, site=SiteMap()), "GET", "/api/map.png")[0] == 404


def test_a_page_for_loopback_is_called_by_no_other_name():
    assert host_names("127.0.0.1", 80) == {"127.0.0.1:80", "localhost:80", "[::1]:80"}
    assert host_names("192.0.2.7", 80) == {"192.0.2.7:80"}


def test_the_network_is_not_served_without_a_word(capsys):
    assert main(["poi", "edit", "--robot", "r1", "--listen", "0.0.0.0"]) == 1
    assert "--insecure" in capsys.readouterr().err


def site_with_map(folder, cells, yaml="resolution: 0.05\norigin: [-2, -1, 0.5]\noccupied_thresh: 0.65\n"):
    cv2.imwrite(str(folder / "hall.png"), cells)
    (folder / "hall.yaml").write_text(f"image: hall.png\n{yaml}")
    (folder / "site.yaml").write_text("name: hall\nmap: hall.yaml\nwalls: [[[0, 0], [1, 0], [1, 1]]]\n")
    return load_site(folder / "site.yaml")


def test_the_robots_map_is_drawn_where_it_lies_with_free_light_and_occupied_dark(tmp_path):
    cells = np.full((40, 60), 254, np.uint8)
    cells[:, 0] = 0
    drawn = site_map(site_with_map(tmp_path, cells))
    assert (drawn.origin, drawn.size_m, len(drawn.walls)) == ((-2, -1, 0.5), (3.0, 2.0), 3)
    assert np.array_equal(cv2.imdecode(np.frombuffer(drawn.picture, np.uint8), cv2.IMREAD_GRAYSCALE), cells)
    raw = np.where(cells == 0, 100, 0).astype(np.uint8)
    raw[5, 5] = 255
    drawn = site_map(site_with_map(tmp_path, raw, "resolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.65\nmode: raw\n"))
    shown = cv2.imdecode(np.frombuffer(drawn.picture, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert (shown[3, 0], shown[3, 3], shown[5, 5]) == (0, 255, 205)


def test_a_large_map_is_sent_smaller_and_keeps_its_size_in_metres(tmp_path):
    drawn = site_map(site_with_map(tmp_path, np.full((20, 2 * MAX_PICTURE_SIDE), 254, np.uint8)))
    assert cv2.imdecode(np.frombuffer(drawn.picture, np.uint8), cv2.IMREAD_GRAYSCALE).shape == (10, MAX_PICTURE_SIDE)
    assert drawn.size_m == pytest.approx((2 * MAX_PICTURE_SIDE * 0.05, 1.0))


def test_a_map_that_is_not_there_is_said_with_its_name(tmp_path):
    site = site_with_map(tmp_path, np.zeros((4, 4), np.uint8))
    (tmp_path / "hall.png").unlink()
    with pytest.raises(CommandError, match=r"hall\.png: No such file"):
        site_map(site)
