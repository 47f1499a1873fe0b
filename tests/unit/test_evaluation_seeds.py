import io
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest
from deixis_evaluation import chosen_clips, clip_cache
from deixis_evaluation.chosen_clips import Choice, choose
from deixis_evaluation.clip_cache import Simulator, default_root
from deixis_evaluation.clips import ClipError
from deixis_evaluation.seeds import SeedsError, parse_seeds, say_set
from rich.console import Console

LABEL = (
    '{"meta": {"kind": "point", "fps": 30, "width": 640, "height": 480, "camera": {"K": [[500,0,319.5],[0,500,239.5],[0,0,1]],'
    '"R_world_to_cam": [1,0,0,0,-1,0,0,0,-1], "t_world_to_cam": [0,1.3,2]}, "pois": []}, "frames": [{"frame": 0}]}'
)


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


class Rendering:
    """A stand-in for the simulator's modules: seed 1003 fails."""

    class Interrupted(Exception):
        """Ctrl-C."""

    def __init__(self) -> None:
        self.rendered: list[str] = []
        self.stopped = False

    def draw_scene(self, seed: int, index: int, kinds: tuple[str, ...], *, plain: bool) -> SimpleNamespace:
        return SimpleNamespace(name=f"{'p' if plain else 's'}{seed:04d}_{index:03d}_{kinds[-1]}")

    def shown_progress(self, _: list[SimpleNamespace]) -> AbstractContextManager[None]:
        return nullcontext()

    def render_all(
        self, scenes: list[SimpleNamespace], folder: Path, *, jobs: int, labels: bool, progress: None
    ) -> SimpleNamespace:
        assert (jobs, labels, progress) == (2, True, None)
        if self.stopped:
            raise self.Interrupted
        folder.mkdir(parents=True, exist_ok=True)
        for scene in scenes:
            if not (folder / f"{scene.name}.json").exists():
                self.rendered.append(scene.name)
                (folder / f"{scene.name}.json").write_text(LABEL)
        return SimpleNamespace(failed={scene.name: "no lamp" for scene in scenes if "1003" in scene.name})


@pytest.fixture
def rendering(monkeypatch: pytest.MonkeyPatch) -> Rendering:
    """A simulator that makes empty clips."""
    made = Rendering()
    monkeypatch.setattr(chosen_clips, "find_simulator", lambda: Simulator("9.9", ("point", "quiet"), made, made, made))
    return made


def test_clips_of_seeds_are_made_once_and_kept_by_version_and_kinds(rendering: Rendering, tmp_path: Path) -> None:
    console = Console(record=True, width=200)
    for _ in range(2):
        chosen = choose(Choice(None, "1000:1003", kinds=("point",), cache=tmp_path, jobs=2), console)
    assert [clip.name for clip in chosen.clips] == [f"s{seed}_000_point" for seed in (1000, 1001, 1002)]
    assert rendering.rendered == [clip.name for clip in chosen.clips]
    assert (chosen.seeds, chosen.folder) == ("1000:1003", tmp_path / "9.9" / "point")
    assert "the set 'choosing'" in console.export_text()


@pytest.mark.parametrize(("kinds", "folder"), [((), "plain-all"), (("point",), "plain-point")])
def test_plain_clips_are_kept_apart(rendering: Rendering, kinds: tuple[str, ...], folder: str, tmp_path: Path) -> None:
    console = Console(file=io.StringIO())
    usual = choose(Choice(None, "1000:1001", kinds=kinds, cache=tmp_path, jobs=2), console)
    plain = choose(Choice(None, "1000:1001", kinds=kinds, cache=tmp_path, jobs=2, plain=True), console)
    assert (usual.plain, plain.plain) == (False, True)
    assert plain.folder == tmp_path / "9.9" / folder
    assert len(rendering.rendered) == 2
    assert [clip.name[0] for clip in (*usual.clips, *plain.clips)] == ["s", "p"]


@pytest.mark.usefixtures("rendering")
def test_clips_of_seeds_are_chosen_by_name_too(tmp_path: Path) -> None:
    chosen = choose(Choice(None, "1000:1002", "*1001*", cache=tmp_path, jobs=2), Console(file=io.StringIO()))
    assert [clip.name for clip in chosen.clips] == ["s1001_000_quiet"]
    with pytest.raises(ClipError, match="is named x"):
        choose(Choice(None, "1000:1002", "x", cache=tmp_path, jobs=2), Console(file=io.StringIO()))


def test_what_cannot_be_rendered_is_said(rendering: Rendering, tmp_path: Path) -> None:
    console = Console(file=io.StringIO())
    with pytest.raises(ClipError, match="1 clips were not rendered: s1003_000_quiet: no lamp"):
        choose(Choice(None, "1003:1004", cache=tmp_path, jobs=2), console)
    with pytest.raises(ClipError, match="--kinds: 'dance' is none of point, quiet"):
        choose(Choice(None, "1003:1004", kinds=("dance",), cache=tmp_path, jobs=2), console)
    (tmp_path / "file").write_text("")
    with pytest.raises(ClipError, match="cannot be kept in"):
        choose(Choice(None, "1000:1001", cache=tmp_path / "file", jobs=2), console)
    rendering.stopped = True
    with pytest.raises(KeyboardInterrupt):
        choose(Choice(None, "1000:1001", cache=tmp_path, jobs=2), console)


@pytest.mark.parametrize(
    ("choice", "named"),
    [
        (Choice(None, None), "either a folder"),
        (Choice(Path("x"), "1:2"), "either a folder"),
        (Choice(Path("x"), None, kinds=("point",)), "go with --seeds"),
        (Choice(Path("x"), None, plain=True), "go with --seeds"),
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
