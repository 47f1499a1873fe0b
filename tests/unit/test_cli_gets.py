"""Gets of the commands: replies up to their topic's size, and an empty registry told from an absent fusion."""

from types import SimpleNamespace

import pytest
from deixis_cli.gets import get_names, get_pois, get_state
from deixis_schemas import codec, topics
from deixis_schemas.messages import Poi, State

POIS = [Poi(poi_id=f"P{number:03}", name=f"thing {number}", position_m=(1, 2, 3)) for number in range(100)]


class Session:
    """Answers gets of `deixis/r1/{path}` with messages; of what is not in `answers` nobody knows."""

    def __init__(self, answers):
        self._answers = answers

    def get(self, selector, **_):
        return [ok(key, message) for key, message in self._answers.get(selector.removeprefix("deixis/r1/"), [])]


def ok(key, message):
    payload = codec.encode(message)
    sample = SimpleNamespace(
        key_expr=f"deixis/r1/{key}",
        payload=SimpleNamespace(to_bytes=lambda: payload),
        encoding=codec.encoding_of(type(message)),
    )
    return SimpleNamespace(ok=sample, err=None)


def state(listed=(), total=0):
    return State(
        stamp_ns=1, stage="fusion", instance="a", robot="r1", sources=[], pois=list(listed), pois_total=total, persons=[]
    )


def test_all_pois_are_found_although_the_state_lists_the_first_few():
    session = Session(
        {
            "fusion/poi/**": [(f"fusion/poi/{poi.poi_id}", poi) for poi in reversed(POIS)],
            "fusion/state": [("fusion/state", state(POIS[:16], 100))],
        }
    )
    assert get_pois(session, "r1") == POIS
    assert get_names(session, "r1")["P099"] == "thing 99"


def test_one_poi_is_asked_for_by_its_key():
    session = Session({"fusion/poi/P007": [("fusion/poi/P007", POIS[7])]})
    assert get_pois(session, "r1", "P007") == [POIS[7]]


def test_an_empty_registry_is_told_from_an_absent_fusion():
    assert get_pois(Session({"fusion/state?top=1024": [("fusion/state", state())]}), "r1") == []
    assert get_pois(Session({}), "r1") is None
    assert get_names(Session({}), "r1") == {}


def test_a_viewer_whose_gets_on_pois_are_denied_is_told_of_them_by_the_state():
    denied = Session({"fusion/state?top=1024": [("fusion/state", state(POIS))]})
    assert get_pois(denied, "r1") == POIS
    assert get_pois(denied, "r1", "P007") == [POIS[7]]
    assert get_names(denied, "r1")["P099"] == "thing 99"


def test_a_state_of_more_than_a_mebibyte_is_read():
    pois = [poi.model_copy(update={"name": "x" * 2000}) for poi in POIS * 8]
    large = state(pois, len(pois))
    assert 1 << 20 < len(codec.encode(large)) < topics.STATE.max_bytes
    assert get_state(Session({"fusion/state": [("fusion/state", large)]}), "r1") == large


@pytest.mark.parametrize("key", ["some/other/key", "fusion/statement"])
def test_a_reply_under_a_key_outside_the_contract_is_refused(key):
    assert get_state(Session({"fusion/state": [(key, state())]}), "r1") is None
