"""Shared memory of killed processes: whose it is, and that nothing that is held is ever removed."""

import fcntl
import os

import pytest
from deixis_runtime.leftovers import Leftovers, let_go, remove_unused
from deixis_runtime.procfs import locked_inodes, parse_locks

LOCKS = """\
1: FLOCK  ADVISORY  WRITE 2956 fe:00:10011186 0 EOF
2: POSIX  ADVISORY  READ 14342 fe:00:10354872 128 128
3: FLOCK  ADVISORY  READ 14294 00:1b:98 0 EOF
4: OFDLCK ADVISORY  READ -1 00:06:3 0 EOF
5: FLOCK  ADVISORY  READ 14294 00:1b:103 0 EOF
5: -> FLOCK  ADVISORY  WRITE 77 00:1b:103 0 EOF
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "4711.zenoh"
    path.write_bytes(b"x")
    return path


def inode(path):
    return path.stat().st_dev, path.stat().st_ino


def test_the_kernels_list_of_locks_says_who_holds_what():
    device = os.makedev(0, 0x1B)
    assert parse_locks(LOCKS) == {2956: {(os.makedev(0xFE, 0), 10011186)}, 14294: {(device, 98), (device, 103)}}


def test_what_an_ended_process_held_is_left_and_what_a_living_one_holds_is_not():
    leftovers = Leftovers()
    leftovers.note({11, 12}, {11: {(1, 100)}, 12: {(1, 200)}, 99: {(1, 900)}})
    leftovers.note({12}, {12: {(1, 200)}})
    assert leftovers.left() == {(1, 100)}
    leftovers.forget({(1, 100)})
    leftovers.note(set(), {})
    assert leftovers.left() == {(1, 200)}, "never what a stranger held"


def test_what_nobody_holds_is_removed(file, tmp_path):
    gone, removed = remove_unused({inode(file)}, tmp_path)
    assert removed == 1
    assert len(gone) == 1
    assert not file.exists()


def test_what_somebody_holds_stays_until_it_is_let_go(file, tmp_path):
    wanted = {inode(file)}
    with file.open() as held:
        fcntl.flock(held, fcntl.LOCK_SH)
        assert inode(file) in locked_inodes()[os.getpid()]
        assert remove_unused(wanted, tmp_path) == (set(), 0)
        assert file.exists()
    assert remove_unused(wanted, tmp_path) == (wanted, 1)


def test_what_was_not_ours_stays(file, tmp_path):
    ours = tmp_path / "1.zenoh"
    ours.write_bytes(b"x")
    assert remove_unused({inode(ours)}, tmp_path)[1] == 1
    assert file.exists()


def test_what_its_process_has_removed_itself_is_gone(file, tmp_path):
    wanted = {inode(file)}
    file.unlink()
    assert remove_unused(wanted, tmp_path) == (wanted, 0)


def test_who_ends_removes_what_it_is_the_last_to_hold_and_nothing_else(file, tmp_path):
    others, plain = tmp_path / "5.zenoh", tmp_path / "notes"
    others.write_bytes(b"x")
    plain.write_bytes(b"x")
    with file.open() as ours, others.open() as shared, others.open() as theirs, plain.open() as other:
        for held in (ours, shared, theirs):
            fcntl.flock(held, fcntl.LOCK_SH)
        descriptors = tmp_path / "fd"
        descriptors.mkdir()
        for held in (ours, shared, other):
            (descriptors / str(held.fileno())).symlink_to(held.name)
        let_go(descriptors, tmp_path)
    assert not file.exists()
    assert others.exists(), "others hold it"
    assert plain.exists()


def test_of_two_that_end_one_after_the_other_the_last_removes(file, tmp_path):
    with file.open() as first, file.open() as second:
        for held in (first, second):
            fcntl.flock(held, fcntl.LOCK_SH)
        for number, held in enumerate((first, second)):
            descriptors = tmp_path / f"fd{number}"
            descriptors.mkdir()
            (descriptors / str(held.fileno())).symlink_to(file)
            assert file.exists()
            let_go(descriptors, tmp_path)
    assert not file.exists()
