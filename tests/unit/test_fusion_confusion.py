"""Table 1 and figure 6: the packaged ones, others from files, and figure 6 as a function."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from deixis_fusion.config import FusionConfig
from deixis_fusion.confusion import fig_6, table_1
from deixis_fusion.evidence import Evidence, HandObservation, Witness
from deixis_fusion.fusion import rules_of
from deixis_fusion.perceived_yaw import PerceivedYaw
from deixis_fusion.pointing import GESTURES, REGIONS
from deixis_fusion.visibility import Candidate
from deixis_runtime.settings import CommonOptions, ConfigError, load_config
from deixis_schemas.messages import Poi
from hypothesis import given
from hypothesis import strategies as st

SAID = Witness("ok", "")
PUBLISHED = {"point_left": [0.90, 0.05, 0.00], "invisible": [0.10, 0.90, 0.10], "point_right": [0.00, 0.05, 0.90]}
FIGURE = PerceivedYaw.of(fig_6())


def config(*sets: str) -> FusionConfig:
    options = CommonOptions("r", "i", "tcp/x:1", lockstep=False, supervised=False, started_before=0, site=None, sets=sets)
    return load_config("fusion", FusionConfig, options)


def hand_table(**changes: Any) -> dict[str, Any]:
    rows = {gesture: {region: table_1().share(gesture, region) for region in REGIONS} for gesture in GESTURES}
    return {"table": rows | changes}


def head_table(**changes: Any) -> dict[str, Any]:
    return fig_6().model_dump() | changes


def test_the_packaged_table_is_the_published_one() -> None:
    assert {gesture: [table_1().share(gesture, region) for region in REGIONS] for gesture in GESTURES} == PUBLISHED


@pytest.mark.parametrize("write", [yaml.safe_dump, json.dumps], ids=["yaml", "json"])
def test_a_measured_table_is_read_from_a_file_and_both_rules_go_by_it(tmp_path: Path, write: Any) -> None:
    measured = hand_table(
        point_left={"left": 0.5, "center": 0.3, "right": 0.0},
        invisible={"left": 0.5, "center": 0.4, "right": 0.5},
        point_right={"left": 0.0, "center": 0.3, "right": 0.5},
    )
    file = tmp_path / "measured"
    file.write_text(write(measured | {"machine": "what a program wrote beside it"}))
    seen = [Candidate(Poi(poi_id=f"P{i}", position_m=(0, 0, 0)), bearing, 1.0) for i, bearing in enumerate((5.0, 90.0))]
    evidence = Evidence(HandObservation("point_left"), SAID, None, SAID)
    for rules, expected in (("paper", 0.5 / 0.8), ("deixis", None)):
        usual = rules_of(config(f"rules={rules}")).judge(seen, evidence).chances[1]
        by_file = rules_of(config(f"rules={rules}", f"confusion.hand={file}")).judge(seen, evidence).chances[1]
        assert by_file < usual
        assert expected is None or by_file == pytest.approx(expected)


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("hand", None, "No such file"),
        ("hand", "]", "not YAML"),
        ("hand", {}, "table: Field required"),
        ("hand", hand_table(wave={}), "table.wave: unknown key"),
        ("hand", hand_table(invisible={"left": 0.1, "center": 0.9}), "table.invisible.right: Field required"),
        ("hand", hand_table(invisible={"left": 0.1, "center": 1.9, "right": 0.1}), "table.invisible.center: .* less than or"),
        ("hand", hand_table(invisible={"left": 0.1, "center": 0.8, "right": 0.1}), "column center sums to 0.9, not to 1"),
        ("head", head_table(perceived_deg=[0, 10]), "table: must have 2 rows of 19 numbers"),
        ("head", head_table(intended_deg=[0, 90]), "intended_deg: must end at 180"),
        ("head", head_table(perceived_deg=[10, 20]), "perceived_deg: must begin at 0 and ascend"),
        ("head", head_table(not_computed=[0.0]), "not_computed: must have 19 numbers"),
        ("head", head_table(not_computed=[0.5] * 19), "column 130 sums to 0.5, not to 1"),
    ],
)
def test_a_bad_file_is_refused_by_its_name_and_field(tmp_path: Path, name: str, content: Any, complaint: str) -> None:
    file = tmp_path / "bad.yaml"
    if content is not None:
        file.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
    with pytest.raises(ConfigError, match=rf"confusion\.{name}: confusion table .*bad\.yaml: .*({complaint})"):
        config(f"confusion.{name}={file}")


# --- figure 6 ----------------------------------------------------------------------------------------------------------


def test_figure_6_is_what_the_text_says_of_it() -> None:
    figure = fig_6()
    success = [figure.table[i][figure.intended_deg.index(yaw)] for i, yaw in enumerate(figure.perceived_deg)]
    assert success == sorted(success, reverse=True)
    assert success[0] > 0.9
    assert min(success) > 0.5
    assert figure.perceived_deg[-1] == 120
    assert [float(total) for total in np.sum([*figure.table, figure.not_computed], axis=0)] == pytest.approx([1.0] * 19)
    assert all(share > 0.5 for yaw, share in zip(figure.intended_deg, figure.not_computed, strict=True) if yaw > 120)


@given(st.lists(st.floats(-180, 180), min_size=1, max_size=20), st.floats(30, 180))
def test_at_any_bearing_the_shares_of_all_readings_sum_to_one(bearings: list[float], limit: float) -> None:
    told = FIGURE.within(limit).distributions(np.array(bearings))
    assert told.min() >= 0
    assert told.sum(axis=0) == pytest.approx(np.ones(len(bearings)))


@given(st.floats(-180, 180), st.floats(-120, 120))
def test_left_and_right_are_mirror_images(bearing: float, yaw: float) -> None:
    at, mirrored = FIGURE.likelihoods(yaw, np.array([bearing])), FIGURE.likelihoods(-yaw, np.array([-bearing]))
    assert at == pytest.approx(mirrored, abs=1e-12)


def test_figure_6_has_the_tables_numbers_at_its_own_angles_and_lines_between() -> None:
    figure = fig_6()
    at_60 = [figure.table[row][6] for row in (5, 6, 7)]
    assert FIGURE.likelihoods(60.0, np.array([50, 60, 70, -60])) == pytest.approx([*figure.table[6][5:8], 0])
    assert FIGURE.likelihoods(65.0, np.array([60.0])) == pytest.approx([(at_60[1] + at_60[2]) / 2])
    unread, bearings = figure.not_computed, np.array([60.0, 125.0, -180.0])
    assert FIGURE.likelihoods(None, bearings) == pytest.approx([unread[6], (unread[12] + unread[13]) / 2, 1])
    # Ahead, left and right are as likely.
    assert FIGURE.likelihoods(10.0, np.array([0.0])) == pytest.approx([figure.table[1][0] / 2])


def test_a_reader_with_a_smaller_range_computes_nothing_beyond_it() -> None:
    nearer = FIGURE.within(100)
    assert nearer.yaw_deg.max() == 100
    expected = FIGURE.likelihoods(None, np.array([110.0])) + FIGURE.likelihoods(110, np.array([110.0]))
    expected += FIGURE.likelihoods(120, np.array([110.0]))
    assert nearer.likelihoods(None, np.array([110.0])) == pytest.approx(expected)
