"""`deixis rehearse`: the real system on the site's own file, with a clip that ships and with clips rendered here."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from deixis_runtime.host import chosen_stages
from deixis_runtime.site import load_site
from deixis_simulation.rehearsal.aims import aims_of
from deixis_simulation.rehearsal.ground import ground_of
from deixis_simulation.rehearsal.performance import Venue, play_trial
from deixis_simulation.rehearsal.places import given_places
from deixis_simulation.rehearsal.trials import plan_trials
from refused import refused
from running import POINTED_AT, ROOT, SITE
from simulation_ready import needs_renderer

DEIXIS = Path(sys.executable).parent / "deixis"
ROOM = {
    "name": "a tiny room",
    "camera": {"source": "0", "rate_hz": 10, "loop": True, "horizontal_fov_deg": 70, "width": 160, "height": 120},
    "pois": [{"poi_id": "lamp", "name": "the lamp", "position_m": [1.6, 1.8, 1.2]}],
}


def rehearse(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [str(DEIXIS), "rehearse", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=280, check=False, cwd=cwd)


def test_a_clip_is_answered_with_the_sites_own_pois(tmp_path: Path) -> None:
    ground = ground_of(load_site(SITE))
    aims = aims_of(ground, given_places(ground, [(2.0, 0.0)]))
    trials = plan_trials(ground, aims, count=1, seed=1, avatars=["somebody"])
    asked = next(trial for trial in trials if trial.aim is not None and trial.aim.poi.poi_id == POINTED_AT)
    for suffix in (".mp4", ".json"):
        shutil.copy(ROOT / "examples" / "clips" / f"pointing{suffix}", tmp_path / f"{asked.scene.name}{suffix}")
    answer = play_trial(asked, Venue(SITE, ground, aims, tmp_path, chosen_stages((), ())))
    assert (answer.asked, answer.poi_ids, answer.outcome, answer.failure) == (POINTED_AT, (POINTED_AT,), "named", None)


def test_plan_needs_no_renderer(tmp_path: Path) -> None:
    done = rehearse("--site", SITE, "--plan", "--from", "2.0,0.5", "--json", "plan.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "a room with ten exhibits: 10 points of interest, people at A (2.0, 0.5)" in done.stdout
    assert (tmp_path / "rehearsal_pointing" / "map.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "plan.json").read_text())["places"]["A"]["position_m"] == [2.0, 0.5]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--from", "9,9"), "--from 9,9: is 12.7 m from the camera"),
        (("--from", "here"), "'here' is not X,Y in metres"),
        (("--count", "0"), "'0' is not a whole number from 1 to 50"),
    ],
)
def test_what_cannot_be_is_refused(arguments: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, complaint = refused(capsys, "rehearse", "--site", SITE, *arguments)
    assert status in (1, 2)
    assert words in complaint


@needs_renderer
@pytest.mark.timeout(300)
def test_a_tiny_site_is_rehearsed(tmp_path: Path) -> None:
    site = tmp_path / "room.yaml"
    site.write_text(yaml.safe_dump(ROOM))
    done = rehearse(
        "--site", site, "--from", "2.0,0.0", "--count", "1", "--jobs", "1", "--out", "out", "--json", "all.json", cwd=tmp_path
    )
    assert done.returncode in (0, 3), done.stderr
    result = json.loads((tmp_path / "all.json").read_text())
    assert result["complete"] is True
    assert result["failures"] == []
    assert result["summary"]["pointings"] == 1
    assert result["summary"]["quiet"] == 1
    assert result["pois"]["lamp"]["tries"] == 1
    assert len(list((tmp_path / "out" / "clips").glob("*.mp4"))) == 2
    assert (tmp_path / "out" / "map.png").exists()
    assert "of 1 pointings." in done.stdout
