"""What SOURCE may be, and what is refused before anything starts."""

import pytest
from deixis_cli.options import CommandError
from deixis_cli.source import Source, read_source


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("0", "device0"),
        ("/dev/video3", "device3"),
        ("rtsp://user:secret@10.0.0.5:554/live?key=1", "10.0.0.5"),
        ("http://[::1]:8080/video", "__1"),
    ],
)
def test_live_sources_are_named_without_their_credentials(text, name):
    assert read_source(text) == Source(text, name, live=True)


def test_a_file_is_named_by_its_stem_and_made_absolute(tmp_path, monkeypatch):
    (tmp_path / "clip: 1.mp4").write_bytes(b"x")
    monkeypatch.chdir(tmp_path)
    expected = Source(str(tmp_path / "clip: 1.mp4"), "clip: 1", live=False)
    assert read_source("clip: 1.mp4") == expected
    assert read_source(f"file://{tmp_path}/clip:%201.mp4") == expected


def test_a_folder_with_pictures_is_a_source(tmp_path):
    folder = tmp_path / "pictures"
    folder.mkdir()
    (folder / "1.png").write_bytes(b"x")
    assert read_source(str(folder)) == Source(str(folder), "pictures", live=False)


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("missing.mp4", "no such file"),
        ("file:///nowhere/missing.mp4", "no such file"),
        ("ftp://host/clip.mp4", "URLs start with"),
        ("rtsp:///clip", "names no host"),
        ("http://[broken/clip", "not a URL"),
        ("x" * 5000, "name too long"),
    ],
)
def test_what_cannot_be_played_is_refused_with_its_cause(text, cause):
    with pytest.raises(CommandError) as refusal:
        read_source(text)
    assert cause in str(refusal.value) or cause in str(refusal.value).lower()


def test_an_empty_file_and_an_empty_folder_are_refused(tmp_path):
    (tmp_path / "empty.mp4").touch()
    (tmp_path / "folder").mkdir()
    for name in ("empty.mp4", "folder"):
        with pytest.raises(CommandError, match="is empty"):
            read_source(str(tmp_path / name))


def test_a_url_that_is_refused_does_not_tell_its_password():
    with pytest.raises(CommandError) as refusal:
        read_source("ftp://user:secret@host/clip.mp4")
    assert "secret" not in str(refusal.value)
