"""Many clips at a time: workers that fail or die name their clip, and the others go on. No picture is rendered."""

import os
import signal

import pytest
from deixis_simulation import jobs
from deixis_simulation.clip_files import ClipFiles, is_finished, write_truth
from deixis_simulation.scene import Scene
from deixis_simulation.truth_meta import meta_truth


def scene(name):
    return Scene(name=name, duration_s=0.1)


def finish(item, folder):
    files = ClipFiles(folder, item.name)
    files.video.write_bytes(b"film")
    write_truth(files.truth, meta_truth(item, {}), [])


def work(item, folder, workplace, _, answers):
    """Stands for rendering; what happens is in the name."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # forked, it has its parent's handler
    (workplace / "begun").touch()
    if item.name == "dies":
        os.kill(os.getpid(), signal.SIGKILL)
    answers.send(("frame", ""))
    if item.name.startswith("SIG"):
        os.kill(os.getppid(), signal.Signals[item.name])
        signal.pause()
    if item.name == "fails":
        answers.send(("failed", "no reason"))
        return
    finish(item, folder)
    answers.send(("done", ""))


@pytest.fixture
def stand_in(monkeypatch):
    monkeypatch.setattr(jobs, "_work", work)
    monkeypatch.setattr(jobs.multiprocessing, "get_context", lambda _: jobs.multiprocessing.context.ForkContext())


@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize("number", [1, 3])
def test_a_worker_that_dies_or_fails_names_its_clip_and_the_others_go_on(tmp_path, number):
    told = []
    progress = jobs.Progress(frame=lambda item: told.append(item.name))
    scenes = [scene(name) for name in ("a", "dies", "b", "fails", "c")]
    outcome = jobs.render_all(scenes, tmp_path, jobs=number, progress=progress)
    assert sorted(outcome.rendered) == ["a", "b", "c"]
    assert "SIGKILL" in outcome.failed["dies"]
    assert outcome.failed["fails"] == "no reason"
    assert sorted(told) == ["a", "b", "c", "fails"]
    assert not list(tmp_path.glob(".unfinished*"))


@pytest.mark.usefixtures("stand_in")
def test_finished_clips_are_not_begun(tmp_path):
    finish(scene("a"), tmp_path)
    outcome = jobs.render_all([scene("a"), scene("b")], tmp_path, jobs=1)
    assert (outcome.skipped, outcome.rendered) == (["a"], ["b"])


@pytest.fixture
def survives_sigterm():
    """SIGTERM that nobody hears fails the test instead of ending it."""

    def unheard(*_):
        raise AssertionError("SIGTERM would have ended the process and left its folders")

    before = signal.signal(signal.SIGTERM, unheard)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.usefixtures("stand_in", "survives_sigterm")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_to_stop_says_what_is_finished_and_what_is_left_and_leaves_no_folder(tmp_path, name):
    with pytest.raises(jobs.Interrupted) as raised:
        jobs.render_all([scene(name) for name in ("a", name, "b")], tmp_path, jobs=1)
    assert raised.value.outcome.rendered == ["a"]
    assert raised.value.outcome.left == [name, "b"]
    assert not list(tmp_path.glob(".unfinished*"))


def test_only_the_same_scene_with_all_its_files_is_finished(tmp_path):
    item = scene("a")
    assert not is_finished(item, tmp_path, labels=False)
    finish(item, tmp_path)
    assert is_finished(item, tmp_path, labels=False)
    assert not is_finished(item, tmp_path, labels=True)
    assert not is_finished(item.model_copy(update={"seed": 1}), tmp_path, labels=False)
    (tmp_path / "a.json").write_text("{")
    assert not is_finished(item, tmp_path, labels=False)
