"""The POI registry, the site file's baseline, and edits as they come over the keys."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgpack
import pytest
from deixis_fusion.poi_edits import EditError, PoiEdits, poi_id_of, read_poi
from deixis_fusion.registry import Delete, Put, Registry, RegistryError, default_path
from deixis_runtime.queries import Edit, Query, Refused
from deixis_runtime.site import SitePoi
from deixis_schemas.codec import encode, encoding_of
from deixis_schemas.messages import MAX_REGISTERED, Poi

PREFIX = "deixis/r1/fusion/poi/"
KEY = PREFIX + "vase"
POI_LABEL = encoding_of(Poi)


def poi(poi_id: str, x: float = 0.0) -> Poi:
    return Poi(poi_id=poi_id, position_m=(x, 0, 0))


def site(**places: float) -> list[Poi]:
    return [SitePoi(poi_id=poi_id, position_m=(x, 0, 0)) for poi_id, x in places.items()]


def places(registry: Registry) -> dict[str, float]:
    return {p.poi_id: p.position_m[0] for p in registry.pois()}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "pois.sqlite"


def test_what_was_put_is_there_when_the_file_is_opened_again(path: Path) -> None:
    registry = Registry(path)
    registry.put(Poi(poi_id="vase", name="Vase", position_m=(1, 2, 3), extent_m=0.3, tags=["blue"]))
    registry.put(poi("door"))
    registry.delete("door")
    before = registry.pois()
    registry.close()
    assert Registry(path).pois() == before


def test_deleting_what_is_not_there_is_refused(path: Path) -> None:
    with pytest.raises(RegistryError, match="poi_id: there is no POI 'ghost'"):
        Registry(path).delete("ghost")


def test_a_full_registry_refuses_one_more_and_still_takes_changes(path: Path) -> None:
    registry = Registry(path)
    registry.apply_site([poi(f"p{i}") for i in range(MAX_REGISTERED)])
    with pytest.raises(RegistryError, match="full"):
        registry.put(poi("more"))
    registry.put(poi("p0", 5))
    assert places(registry)["p0"] == 5


def test_only_what_changed_in_the_site_file_is_applied_and_operators_edits_persist(path: Path) -> None:
    registry = Registry(path)
    assert registry.apply_site(site(a=1, b=2, c=3, d=4)) == ["a", "b", "c", "d"]
    registry.put(poi("a", 10))
    registry.put(poi("mine", 7))
    registry.delete("d")
    registry.close()
    registry = Registry(path)
    assert registry.apply_site(site(a=1, b=20, e=5, d=4)) == ["b", "c", "e"]
    # a: moved by the operator; b: changed in the file; c: gone from it; d: deleted by the operator; e: new in it.
    assert places(registry) == {"a": 10, "b": 20, "e": 5, "mine": 7}


def test_the_same_site_file_changes_nothing(path: Path) -> None:
    registry = Registry(path)
    registry.apply_site(site(a=1))
    registry.delete("a")
    assert registry.apply_site(site(a=1)) == []
    assert places(registry) == {}


def test_a_failed_write_leaves_memory_as_the_disk_is(path: Path) -> None:
    registry = Registry(path)
    registry.put(poi("a"))
    registry._db.execute("PRAGMA query_only = ON")
    with pytest.raises(RegistryError, match="not written"):
        registry.put(poi("b"))
    with pytest.raises(RegistryError, match="not written"):
        registry.delete("a")
    assert places(registry) == {"a": 0}


def test_the_default_file_depends_on_robot_and_site(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    one = default_path("r1", Path("sites/lab.yaml"))
    assert one.parent == tmp_path / "deixis" / "r1"
    assert one.name.startswith("lab-")
    assert len({one, default_path("r2", Path("sites/lab.yaml")), default_path("r1", Path("lab.yaml"))}) == 3
    assert one == default_path("r1", Path("sites/../sites/lab.yaml"))


@pytest.mark.parametrize("robot", ["..", ".", "", "a/b", "-x", "r1\n"])
def test_a_robots_name_never_leads_out_of_the_folder_of_the_registries(robot: str) -> None:
    with pytest.raises(RegistryError, match="the robot's name"):
        default_path(robot, Path("lab.yaml"))


def test_without_a_file_the_registry_is_in_memory_and_leaves_nothing_behind(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    registry = Registry(None)
    registry.apply_site(site(a=1))
    registry.put(poi("b", 2))
    assert places(registry) == {"a": 1, "b": 2}
    registry.close()
    assert list(tmp_path.iterdir()) == []


def test_many_changes_are_one_transaction_and_each_is_refused_on_its_own(path: Path) -> None:
    registry = Registry(path)
    statements: list[str] = []
    registry._db.set_trace_callback(statements.append)
    results = registry.apply(
        [*(Put(poi(f"p{i}", i)) for i in range(300)), Delete("ghost"), Delete("p7"), Delete("p7"), Put(poi("p8", -1))]
    )
    assert [type(result) for result in results[300:]] == [RegistryError, Poi, RegistryError, Poi]
    assert statements.count("COMMIT") == 1
    registry.close()
    stored = places(Registry(path))
    assert (len(stored), stored["p8"], "p7" in stored) == (299, -1, False)


def test_a_full_registry_takes_what_fits_of_many_changes(path: Path) -> None:
    registry = Registry(path)
    results = registry.apply([Put(poi(f"p{i}")) for i in range(MAX_REGISTERED + 3)])
    assert [isinstance(result, RegistryError) for result in results] == [False] * MAX_REGISTERED + [True] * 3


def test_where_the_disk_refuses_all_changes_of_a_transaction_are_refused(path: Path) -> None:
    registry = Registry(path)
    registry._db.execute("PRAGMA query_only = ON")
    assert all(isinstance(result, RegistryError) for result in registry.apply([Put(poi("a")), Delete("ghost")]))
    assert places(registry) == {}


# --- edits ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("label", ["application/json", "", "zenoh/bytes", "zenoh/string", "text/json"])
def test_a_poi_is_read_from_json_as_generic_clients_send_it(label: str) -> None:
    assert read_poi("vase", b'{"position_m": [1, 2, 3]}', label) == Poi(poi_id="vase", position_m=(1, 2, 3))


def test_a_poi_is_read_from_msgpack() -> None:
    wanted = Poi(poi_id="vase", position_m=(1, 2, 3), tags=["x"])
    assert read_poi("vase", encode(wanted), POI_LABEL) == wanted


@pytest.mark.parametrize(
    ("payload", "label", "complaint"),
    [
        (b'{"position_m": [1, 2]}', "", r"^position_m"),
        (b'{"position_m": ["east", 2, 3]}', "", r"^position_m\.0"),
        (b'{"position_m": [NaN, 2, 3]}', "", r"^position_m\.0"),
        (b'{"position_m": [1e999, 2, 3]}', "", r"^position_m\.0"),
        (b'{"position_m": [1, 2, 3], "extent_m": -1}', "", r"^extent_m"),
        (b'{"position_m": [1, 2, 3], "poi_id": "door"}', "", r"^poi_id: 'door', but the key ends in 'vase'"),
        (b"{}", "", r"^position_m"),
        (b"[1, 2, 3]", "", r"^payload: not an object"),
        (b"\xff\xfe garbage", "", r"^payload: not JSON"),
        (b"[" * 100_000, "", r"^payload"),
        (b"", "", r"^payload: not JSON"),
        (b"\xc1 garbage", POI_LABEL, "not msgpack"),
        (b"{}", "application/msgpack;Poi/9", "^encoding: Poi version '9'"),
        (b"{}", "application/msgpack;Frame/1", "^encoding: 'Frame/1'"),
        (b"{}", "image/png", "^encoding: 'image/png'"),
    ],
)
def test_a_malformed_poi_is_refused_with_the_fields_name(payload: bytes, label: str, complaint: str) -> None:
    with pytest.raises(EditError, match=complaint):
        read_poi("vase", payload, label)


# A line break, an escape, an end of text, a C1 control, a line separator, an override, an isolate, half of a character.
STEERING = ["\n", "\x1b", "\x00", "\x9b", "\u2028", "\u202e", "\u2066", "\ud800"]


@pytest.mark.parametrize("bad", STEERING)
@pytest.mark.parametrize("field", ["name", "tags", "edited_by", "poi_id"])
def test_a_control_character_is_refused_with_the_fields_name_and_never_repeated(field: str, bad: str) -> None:
    content = {"position_m": [1, 2, 3], field: ["ok", f"ab{bad}c"] if field == "tags" else f"ab{bad}c"}
    with pytest.raises(EditError, match=f"^{field}") as refused:
        read_poi("vase", json.dumps(content).encode(), "application/json")
    assert bad not in str(refused.value)
    if field != "poi_id" and bad != "\ud800":
        assert f"character 3 is the control character U+{ord(bad):04X}" in str(refused.value)


def test_names_of_any_script_with_marks_of_direction_and_joiners_are_plain() -> None:
    for name in (
        "Vase \u200f\u05d0\u05d2\u05e8\u05d8\u05dc",
        "\u82b1\u74f6",
        "Caf\u00e9 No\u00a05",
        "\U0001f469\u200d\U0001f33e",
    ):
        assert read_poi("vase", json.dumps({"position_m": [1, 2, 3], "name": name}).encode(), "").name == name


@pytest.mark.parametrize("bad", STEERING[:-1])
def test_who_edits_and_ids_in_a_query_hold_no_control_characters(edits: PoiEdits, bad: str) -> None:
    put = {"position_m": [1, 2, 3]}
    many = query(f"{PREFIX}*", {f"a{bad}": put}, op="put_all")
    for asked in (
        query(payload=put, by=f"me{bad}"),
        query(f"{PREFIX}a{bad}", put),
        query(f"{PREFIX}a{bad}", op="delete"),
        many,
    ):
        with pytest.raises(Refused) as refused:
            edits.answer(asked, 0)
        assert bad not in str(refused.value)
    assert edits.accepted == 0


def test_a_registry_of_an_earlier_version_with_control_characters_is_read_with_spaces_for_them(path: Path) -> None:
    registry = Registry(path)
    registry.put(Poi.model_construct(**poi("vase").model_dump() | {"name": "a\nb\x1b", "tags": ["\x00"]}))
    registry.close()
    (kept,) = Registry(path).pois()
    assert (kept.name, kept.tags) == ("a b ", [" "])


@pytest.mark.parametrize(
    "key",
    [
        "deixis/r1/fusion/poi/*", "deixis/r1/fusion/poi/**", "deixis/r1/fusion/poi/", "fusion/state", "a/$*",
        "deixis/r1/fusion/poi/x/fusion/poi/vase", "deixis/r2/fusion/poi/vase", "deixis/*/fusion/poi/vase",
        "x/deixis/r1/fusion/poi/vase", "deixis/r1/fusion/poi/vase/",
    ],
)  # fmt: skip
def test_an_edit_needs_the_key_of_one_poi_of_this_robot(key: str) -> None:
    with pytest.raises(EditError, match="key: "):
        poi_id_of(PREFIX, key)


@pytest.mark.parametrize("poi_id", ["two words", "x" * 65, "..", "-x"])
def test_an_id_that_the_contract_refuses_is_refused(poi_id: str) -> None:
    with pytest.raises(EditError, match=r"^poi_id"):
        read_poi(poi_id_of(PREFIX, PREFIX + poi_id), b'{"position_m": [1, 2, 3]}', "")


Announced = list[tuple[str, Poi | None]]


@pytest.fixture
def announced() -> Announced:
    return []


@pytest.fixture
def edits(path: Path, announced: Announced) -> PoiEdits:
    registry = Registry(path)
    registry.apply_site(site(vase=1, door=2))
    return PoiEdits(registry, PREFIX, lambda poi_id, stored: announced.append((poi_id, stored)))


def query(key: str = KEY, payload: dict[str, Any] | None = None, **parameters: str) -> Query:
    return Query(key, parameters, json.dumps(payload).encode() if payload is not None else None, "application/json")


def test_a_get_answers_each_matching_poi_under_its_own_key(edits: PoiEdits) -> None:
    replies = edits.answer(query("deixis/r1/fusion/poi/**"), 0)
    assert [key for key, _ in replies] == ["deixis/r1/fusion/poi/door", KEY]
    assert [key for key, _ in edits.answer(query(KEY), 0)] == [KEY]
    assert [key for key, _ in edits.answer(query("deixis/*/fusion/**/v$*"), 0)] == [KEY]
    assert edits.answer(query("deixis/r1/fusion/poi/ghost"), 0) == []


def test_an_acknowledged_edit_is_answered_and_announced_with_what_is_on_disk(
    edits: PoiEdits, announced: Announced, path: Path
) -> None:
    ((key, stored),) = edits.answer(query(payload={"position_m": [9, 8, 7]}), 0)
    assert (key, stored) == (KEY, Poi(poi_id="vase", position_m=(9, 8, 7)))
    ((_, deleted),) = edits.answer(query("deixis/r1/fusion/poi/door", op="delete"), 0)
    assert isinstance(deleted, Poi)
    assert deleted.poi_id == "door"
    assert announced == [("vase", stored), ("door", None)]
    edits._registry.close()
    assert places(Registry(path)) == {"vase": 9}
    assert edits.accepted == 2


@pytest.mark.parametrize(
    ("asked", "complaint"),
    [
        (query(payload={"position_m": [1, 2, "x"]}), r"^position_m\.2"),
        (query(op="put"), "^payload"),
        (query("deixis/r1/fusion/poi/ghost", op="delete"), "^poi_id: there is no POI 'ghost'"),
        (query("deixis/r1/fusion/poi/*", op="delete"), "^key"),
        (query("deixis/r1/fusion/poi/x/fusion/poi/vase", payload={"position_m": [1, 2, 3]}), "^key"),
    ],
)
def test_a_refused_edit_names_the_field_and_is_counted(
    edits: PoiEdits, announced: Announced, asked: Query, complaint: str
) -> None:
    with pytest.raises(Refused, match=complaint):
        edits.answer(asked, 5)
    assert (edits.accepted, edits.rejected, announced) == (0, 1, [])
    assert (edits.rejections[0].key, edits.rejections[0].stamp_ns) == (asked.key, 5)


def test_a_parameter_that_is_not_known_is_refused_and_nothing_done(edits: PoiEdits) -> None:
    with pytest.raises(Refused, match=r"^operation: unknown parameter"):
        edits.answer(query("deixis/r1/fusion/poi/door", operation="delete"), 0)
    assert len(edits.answer(query("deixis/r1/fusion/poi/*", _timeout="1", format="json"), 0)) == 2


def test_an_edit_says_who_and_when_and_so_does_the_site_file(edits: PoiEdits, path: Path) -> None:
    edits.answer(query(payload={"position_m": [9, 8, 7], "edited_by": "x", "edited_ns": 3}, by="anna@desk"), 5)
    edits.take([Edit(PREFIX + "lamp", "put", b'{"position_m": [1, 2, 3], "edited_by": "tool"}', "")], 7)
    edits._registry.close()
    kept = {poi.poi_id: (poi.edited_by, poi.edited_ns) for poi in Registry(path).pois()}
    assert kept == {"vase": ("anna@desk", 5), "lamp": ("tool", 7), "door": ("site file", 0)}


def test_who_edited_an_entry_does_not_make_the_site_file_another(path: Path) -> None:
    registry = Registry(path)
    registry.apply_site(site(a=1), now_ns=5)
    assert registry.apply_site(site(a=1), now_ns=9) == []
    assert registry.pois()[0].edited_ns == 5


MANY = "deixis/r1/fusion/poi/*"


def test_many_pois_are_put_as_one_edit(edits: PoiEdits, announced: Announced) -> None:
    many = {f"p{i}": {"position_m": [i, 0, 0]} for i in range(400)}
    replies = edits.answer(query(MANY, many, op="put_all", by="anna"), 5)
    assert [key for key, _ in replies] == [f"{PREFIX}p{i}" for i in range(400)]
    assert (edits.accepted, len(announced), len(edits._registry.pois())) == (400, 400, 402)
    assert edits._registry.get("p7") == Poi(poi_id="p7", position_m=(7, 0, 0), edited_by="anna", edited_ns=5)


@pytest.mark.parametrize(
    ("key", "second", "complaint"),
    [
        (MANY, {"position_m": [1, 2, "x"]}, r"^b: position_m\.2"),
        (MANY, {"poi_id": "c", "position_m": [1, 2, 3]}, "^poi_id: 'c', but it stands under 'b'"),
        (MANY, [1, 2, 3], "^b: not an object but list"),
        (KEY, {"position_m": [1, 2, 3]}, "^key: "),
    ],
)
def test_of_many_pois_all_are_put_or_none(edits: PoiEdits, key: str, second: object, complaint: str) -> None:
    with pytest.raises(Refused, match=complaint):
        edits.answer(query(key, {"a": {"position_m": [1, 2, 3]}, "b": second}, op="put_all"), 5)
    assert places(edits._registry) == {"door": 2, "vase": 1}
    assert (edits.accepted, edits.rejected) == (0, 1)


def test_of_many_pois_that_do_not_fit_none_is_put(edits: PoiEdits) -> None:
    edits._registry.apply([Put(poi(f"p{i}")) for i in range(MAX_REGISTERED - 3)])
    with pytest.raises(Refused, match="the registry is full"):
        edits.answer(query(MANY, {name: {"position_m": [1, 2, 3]} for name in "ab"}, op="put_all"), 5)
    assert len(edits._registry.pois()) == MAX_REGISTERED - 1


def test_an_operation_that_is_not_known_is_refused(edits: PoiEdits) -> None:
    with pytest.raises(Refused, match=r"^op: 'drop'"):
        edits.answer(query(op="drop"), 0)


def test_edits_without_an_answer_do_the_same_and_their_refusals_are_kept(edits: PoiEdits, announced: Announced) -> None:
    put = Edit(KEY, "put", msgpack.packb({"position_m": [3, 3, 3]}), POI_LABEL)
    gone = Edit(KEY, "delete", b"", "")
    refused = edits.take([put, gone, gone, Edit(KEY, "put", b"{}", "")], 7)
    reasons = ["poi_id: there is no POI 'vase'", "position_m: Field required"]
    assert sorted(refused) == [f"{KEY}: {reason}" for reason in reasons]
    assert (edits.accepted, edits.rejected) == (2, 2)
    assert sorted(edit.reason for edit in edits.rejections) == reasons
    assert announced == []


def test_only_the_last_refusals_are_kept(edits: PoiEdits) -> None:
    edits.take([Edit(f"{PREFIX}g{i}", "delete", b"", "") for i in range(100)], 0)
    assert (edits.rejected, len(edits.rejections)) == (100, 16)
    assert edits.rejections[-1].key.endswith("g99")


def test_a_key_of_any_length_can_be_refused(edits: PoiEdits) -> None:
    edits.take([Edit(PREFIX + "x" * 9000, "put", b"{}", ""), Edit(PREFIX + "y" * 9000, "delete", b"", "")], 0)
    assert [len(edit.key) for edit in edits.rejections] == [2000, 2000]
