import sys
from pathlib import Path

import pytest
from deixis_evaluation import clip_cache
from deixis_evaluation.chosen_clips import Choice, choose
from deixis_evaluation.clip_cache import ClipCache, default_root, make_missing
from deixis_evaluation.clips import ClipError
from deixis_evaluation.seeds import SeedsError, parse_seeds, say_set
from rich.console import Console

LABEL = (
    '{"meta": {"kind": "point", "fps": 30, "width": 640, "height": 480, "camera": {"K": [[500,0,319.5],[0,500,239.5],[0,0,1]],'
    '"R_world_to_cam": [1,0,0,0,-1,0,0,0,-1], "t_world_to_cam": [0,1.3,2]}, "pois": []}, "frames": [{"frame": 0}]}'
)
SIMULATOR = f"""#!{sys.executable}
import sys, pathlib
sys.argv.remove("--labels")
given = dict(zip(sys.argv[2::2], sys.argv[3::2]))
seed = int(given["--seed"])
if seed == 1003:
    sys.exit("no lamp in this room")
assert sys.argv[1] == "simulate" and given["--count"] == "1"
for end, text in ((".mp4", ""), (".json", {LABEL!r})):
    pathlib.Path(given["--out"], f"s{{seed:04d}}_000_{{given.get('--kinds', 'point')}}{{end}}").write_text(text)
"""


@pytest.mark.parametrize(
    ("text", "purpose"), [("0:1000", "fitting"), ("999:1000", "fitting"), ("1000:1060", "choosing"), ("2000:2060", "reporting")]
)
def test_seeds_know_what_they_are_for(text: str, purpose: str) -> None:
    seeds = parse_seeds(text)
    assert (seeds.purpose, str(seeds)) == (purpose, text)
    assert f"are for {purpose}" in say_set(seeds)


@pytest.mark.parametrize(
    "text", ["", "5", "5:5", "6:5", "-1:4", "a:b", "999:1001", "1990:2010", "0:1001", "3000:9000", "1:2:3"]
)
def test_seeds_that_are_none_too_many_or_of_two_sets_are_refused(text: str) -> None:
    with pytest.raises(SeedsError, match="--seeds"):
        parse_seeds(text)


@pytest.fixture
def simulator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A stand-in for `deixis simulate`, which fails on seed 1003."""
    script = tmp_path / "bin" / "deixis"
    script.parent.mkdir()
    script.write_text(SIMULATOR)
    script.chmod(0o755)
    monkeypatch.setattr(clip_cache.sys, "executable", str(script.parent / "python"))
    monkeypatch.setattr(clip_cache, "version", lambda _: "9.9")
    return script


def test_clips_of_seeds_are_made_once_and_kept_by_version_and_kinds(simulator: Path, tmp_path: Path) -> None:
    cache = ClipCache(tmp_path / "cache", "9.9", ("point", "quiet"))
    made: list[int] = []
    make_missing(cache, range(1000, 1003), 2, made.append)
    assert sorted(made) == [1000, 1001, 1002]
    assert [clip.name for clip in cache.load(range(1000, 1003))] == [f"s{seed}_000_point,quiet" for seed in (1000, 1001, 1002)]
    simulator.unlink()
    make_missing(cache, range(1000, 1003), 2, made.append)
    assert len(made) == 3
    assert cache.folder == tmp_path / "cache" / "9.9" / "point-quiet"


@pytest.mark.usefixtures("simulator")
def test_what_the_simulator_says_when_it_fails_is_passed_on(tmp_path: Path) -> None:
    with pytest.raises(ClipError, match="seed 1003 was not made: no lamp"):
        make_missing(ClipCache(tmp_path, "9.9"), [1003], 1)
    with pytest.raises(ClipError, match="no clip of seed 7"):
        ClipCache(tmp_path, "9.9").load([7])


@pytest.mark.usefixtures("simulator")
def test_a_choice_by_seeds_says_the_set_and_loads_its_clips(tmp_path: Path) -> None:
    console = Console(record=True, width=200)
    chosen = choose(Choice(None, "1000:1002", cache=tmp_path, pattern="*1001*"), console)
    assert [clip.name for clip in chosen.clips] == ["s1001_000_point"]
    assert chosen.seeds == "1000:1002"
    assert "the set 'choosing'" in console.export_text()
    with pytest.raises(ClipError, match="is named x"):
        choose(Choice(None, "1000:1002", cache=tmp_path, pattern="x"), console)


@pytest.mark.parametrize(
    ("choice", "named"),
    [
        (Choice(None, None), "either a folder"),
        (Choice(Path("x"), "1:2"), "either a folder"),
        (Choice(Path("x"), None, kinds=("point",)), "go with --seeds"),
    ],
)
def test_a_folder_and_seeds_exclude_each_other(choice: Choice, named: str) -> None:
    with pytest.raises(ClipError, match=named):
        choose(choice, Console())


def test_without_the_simulator_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clip_cache, "SIMULATOR", "deixis-no-such-thing")
    with pytest.raises(ClipError, match=r"not installed: pip install .*\./simulation"):
        choose(Choice(None, "1000:1001"), Console())


def test_clips_are_kept_in_the_users_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_root() == tmp_path / "deixis" / "clips"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert default_root() == Path.home() / ".cache" / "deixis" / "clips"
