"""`deixis poi edit` in a real browser, before a real router and fusion."""

import json
import re
import subprocess
import urllib.error
import urllib.request

import pytest
from deixis_cli.main import main
from fusion_bench import fusion_bench, router
from headless_browser import needs_chromium
from headless_browser import page as browser_page
from running import SITE, command, process, tail, wait_until


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Fusion with the example's POIs, without any other stage."""
    with router() as endpoint, fusion_bench(endpoint, tmp_path_factory.mktemp("fusion")) as it:
        it.start("--site", str(SITE))
        yield it


@pytest.fixture(scope="module")
def address(bench, tmp_path_factory):
    """Where the page is served."""
    log = tmp_path_factory.mktemp("page") / "log"
    asked = ("--robot", bench.robot, "--connect", bench.endpoint, "--site", SITE, "--by", "anna")
    with process(command("deixis", "poi", "edit", *asked), log) as child:

        def said():
            assert child.poll() is None, tail(log)
            return re.search(r"http://127\.0\.0\.1:\d+/#token=\S+", log.read_text())

        yield wait_until(said, "the page's address", 30, log)[0]


@pytest.fixture(scope="module")
def page(address, tmp_path_factory):
    """The page, opened and shown with the points."""
    # It draws on a plain canvas, and needs no emulated GPU.
    with browser_page(tmp_path_factory.mktemp("browser"), (1280, 800), "--disable-gpu") as it:
        it.note_errors()
        it.open(address)
        it.wait_for("document.querySelector('#status')?.textContent === 'live'")
        it.wait_for("document.querySelectorAll('#pois li').length === 10")
        yield it


def listed(bench):
    """POIs by id, as `deixis poi list` tells them."""
    argv = command("deixis", "poi", "list", "--json", "--robot", bench.robot, "--connect", bench.endpoint)
    out = subprocess.run(argv, capture_output=True, text=True, timeout=30, check=True).stdout
    return {poi["poi_id"]: poi for poi in json.loads(out)}


def stored(bench):
    """POIs by id, as the registry holds them."""
    return {poi.poi_id: poi for poi in bench.state("?top=1024").pois}


def place_of(page, poi_id):
    """Where a POI of the registry is drawn, pixels of the page."""
    page.press(f"#pois button[title='{poi_id}']")
    x, y = (float(page.run(f"document.querySelector('#form').elements.{axis}.value")) for axis in "xy")
    page.press("#cancel")
    return pixel_of(page, x, y)


def pixel_of(page, x, y):
    """The pixel of a place on the map, by what the page says of two others."""
    left, top = page.run("(({left, top}) => [left, top])(document.querySelector('#canvas').getBoundingClientRect())")
    told = []
    for at in ((200, 200), (400, 400)):
        page.mouse("mouseMoved", left + at[0], top + at[1])
        shown = page.run("document.querySelector('#cursor').textContent")
        told.append([float(part) for part in re.findall(r"-?\d+\.\d+", shown)])
    (x0, y0), (x1, y1) = told
    return left + 200 + 200 * (x - x0) / (x1 - x0), top + 200 + 200 * (y - y0) / (y1 - y0)


@needs_chromium
def test_a_click_adds_a_poi_a_drag_moves_it_and_both_are_in_the_registry(page, bench):
    assert "the ship model" in page.text()
    page.click(*pixel_of(page, 2.0, 0.0))
    page.wait_for("!document.querySelector('#form').hidden")
    page.type_into("[name=name]", "the globe's twin")
    page.type_into("[name=z]", "far")
    page.press("#save")
    page.wait_for("document.querySelector('#message').textContent.startsWith('not saved: Height: \"far\" is no number')")
    assert page.run("document.querySelector('[name=z]').getAttribute('aria-invalid')") == "true"
    assert "P11" not in stored(bench)
    page.type_into("[name=z]", "1.25")
    page.press("#save")
    page.wait_for("document.querySelector('#message').textContent.startsWith('saved')")
    added = listed(bench)["P11"]
    assert (added["name"], added["edited_by"], added["position_m"][2]) == ("the globe's twin", "anna", 1.25)
    assert added["position_m"][:2] == pytest.approx([2.0, 0.0], abs=0.03)
    page.drag(pixel_of(page, 2.0, 0.0), pixel_of(page, 3.0, -1.0))
    page.wait_for("document.querySelector('[name=x]').value.startsWith('3')")
    page.wait_for("document.querySelector('#message').textContent.startsWith('saved')")
    assert stored(bench)["P11"].position_m == pytest.approx([3.0, -1.0, 1.25], abs=0.05)
    assert page.errors == []


@needs_chromium
def test_a_comma_in_a_number_is_read_and_what_is_no_number_is_refused_by_its_label(page, bench):
    before = stored(bench)["P2"]
    page.press("#pois button[title='P2']")
    for field, typed, said in (
        ("x", "1,2,3", 'x: "1,2,3" is no number'),
        ("y", "2m", 'y: "2m" is no number'),
        ("z", "", 'Height: "" is no number'),
        ("z", "1e1", 'Height: "1e1" is no number'),
        ("extent_m", "-1", "Size across (extent_m): "),
        ("x", "100001", "x (position_m.0): "),
    ):
        kept = page.run(f"document.querySelector('[name={field}]').value")
        page.type_into(f"[name={field}]", typed)
        page.press("#save")
        page.wait_for(f"document.querySelector('#message').textContent.startsWith({json.dumps('not saved: ' + said)})")
        assert page.run(f"document.querySelector('[name={field}]').getAttribute('aria-invalid')") == "true"
        assert stored(bench)["P2"] == before
        page.type_into(f"[name={field}]", kept)
    page.type_into("[name=x]", "2,5")
    page.type_into("[name=extent_m]", ",25")
    page.press("#save")
    page.wait_for("document.querySelector('#message').textContent.startsWith('saved')")
    after = stored(bench)["P2"]
    assert (after.position_m, after.extent_m) == ((2.5, *before.position_m[1:]), 0.25)
    assert page.run("document.querySelector('[name=x]').value") == "2.5"
    page.press("#cancel")
    assert page.errors == []


@needs_chromium
def test_an_edit_is_undone_a_delete_asks_first_and_edits_of_others_appear(page, bench):
    before = stored(bench)["P3"]
    page.drag(place_of(page, "P3"), pixel_of(page, 0.0, -1.9))
    page.wait_for("document.querySelector('#message').textContent.startsWith('saved')")
    assert stored(bench)["P3"].position_m[1] == pytest.approx(-1.9, abs=0.05)
    page.press("#undo")
    page.wait_for("document.querySelector('#status').textContent.startsWith('undone')")
    assert stored(bench)["P3"].position_m == before.position_m
    page.press("#delete")
    page.wait_for("document.querySelector('#question').open")
    assert "P3" in stored(bench)
    page.press("#question [value=yes]")
    page.wait_for("!document.querySelector('#pois button[title=P3]')")
    assert "P3" not in stored(bench)
    assert bench.ask("fusion/poi/lamp?by=bob", {"name": "bob's lamp", "position_m": [1, 1, 1]})[0] == "ok"
    page.wait_for("document.querySelector('#pois').textContent.includes(\"bob's lamp\")")
    assert page.errors == []


@needs_chromium
def test_what_is_typed_outlives_fusion_and_the_page_says_that_it_is_gone(page, bench):
    page.press("#pois button[title='P1']")
    page.type_into("[name=name]", "the green vase")
    assert bench.stop() == 0
    page.wait_for("document.querySelector('#status').textContent.includes('does not answer; waiting for it. What you typed')")
    page.press("#save")
    page.wait_for("document.querySelector('#message').textContent.startsWith('not saved: fusion')")
    bench.start("--site", str(SITE))
    page.wait_for("document.querySelector('#status').textContent === 'live'")
    assert page.run("document.querySelector('[name=name]').value") == "the green vase"
    page.press("#save")
    page.wait_for("document.querySelector('#message').textContent.startsWith('saved')")
    assert stored(bench)["P1"].name == "the green vase"


def test_the_server_refuses_what_is_too_large_and_who_does_not_know_the_token(address, bench):
    url, _, token = address.partition("#token=")
    before = stored(bench)

    def put(body, **headers):
        asked = urllib.request.Request(f"{url}api/pois/P2", body, {"Content-Type": "application/json", **headers}, method="PUT")
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(asked, timeout=20)
        return refused.value.code

    assert put(b'{"position_m": [0, 0, 0]}') == 403
    assert put(b'{"position_m": [0, 0, 0]}', **{"X-Deixis-Token": token, "Origin": "http://evil.example"}) == 403
    assert put(b" " * 70_000, **{"X-Deixis-Token": token}) == 413
    assert stored(bench) == before


def test_without_a_router_the_command_says_so(free_port, capsys):
    assert main(["poi", "edit", "--robot", "r1", "--connect", f"tcp/127.0.0.1:{free_port}"]) == 1
    assert "no Zenoh router answers" in capsys.readouterr().err
