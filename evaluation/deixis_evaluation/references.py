"""What each stage answers to the shipped clips, kept beside the code: a change of one stage shows, and shows in that one alone.

    python -m deixis_evaluation.references CLIPS REFERENCES        (`make references`)

replays every stage on every clip of the folder CLIPS, gives each the references of the stages before it, says what differs from
the references that were there, and writes the new ones: REFERENCES/CLIP.STAGE.xz, the stage's messages in their order.
"""

from __future__ import annotations

import argparse
import lzma
import sys
from collections.abc import Sequence
from pathlib import Path

import msgpack
from deixis_schemas.codec import CodecError, decode_any, encode, encoding_of
from deixis_schemas.messages import Message

from .clips import Clip, ClipError, load_clips
from .differences import differences
from .replay import REPLAYS, Given, ReplayError

HOW_TO_RENEW = (
    "If this is meant: `make references` says all that has changed; `deixis eval examples/clips --lockstep` before and after "
    "says what it is worth. Commit the references with the change."
)


class ReferencesError(ValueError):
    """References that are missing or cannot be read; the text names the file."""


def read_reference(folder: Path, clip: str, stage: str) -> list[Message]:
    """What the stage answered to the clip. Raises ReferencesError."""
    path = _path(folder, clip, stage)
    try:
        entries = msgpack.unpackb(lzma.decompress(path.read_bytes()))
        return [decode_any(payload, encoding) for encoding, payload in entries]
    except OSError as error:
        raise ReferencesError(f"reference '{path}': {error.strerror}") from None
    except (lzma.LZMAError, ValueError, TypeError, msgpack.UnpackException, CodecError) as error:
        raise ReferencesError(f"reference '{path}' cannot be read: {error}") from None


def write_reference(folder: Path, clip: str, stage: str, messages: Sequence[Message]) -> int:
    """Store what the stage answered. Equal messages give equal bytes. Returns how many bytes."""
    packed = lzma.compress(_pack(messages), preset=9 | lzma.PRESET_EXTREME)
    _path(folder, clip, stage).write_bytes(packed)
    return len(packed)


def replay_given(clip: Clip, stage: str, folder: Path) -> list[Message]:
    """What the stage answers now, given the references of those before it. Raises ReferencesError or ReplayError."""
    before = list(REPLAYS)[: list(REPLAYS).index(stage)]
    answers = [message for name in before for message in read_reference(folder, clip.name, name)]
    return list(REPLAYS[stage](Given(clip, answers)))


def renew(clip: Clip, stage: str, folder: Path) -> str:
    """Replay one stage, store its answers for the new reference, and say in words what differs from the old one."""
    made = replay_given(clip, stage, folder)
    if not _path(folder, clip.name, stage).exists():
        return f"new, {write_reference(folder, clip.name, stage, made)} bytes"
    try:
        before = read_reference(folder, clip.name, stage)
    except ReferencesError as error:
        return f"{error}; new, {write_reference(folder, clip.name, stage, made)} bytes"
    if _pack(before) == _pack(made):
        return "the same"
    write_reference(folder, clip.name, stage, made)
    beyond = differences(stage, before, made)
    return "\n  ".join(["changed", *map(str, beyond)]) if beyond else "changed within the tolerances"


def _path(folder: Path, clip: str, stage: str) -> Path:
    return folder / f"{clip}.{stage}.xz"


def _pack(messages: Sequence[Message]) -> bytes:
    return bytes(msgpack.packb([(encoding_of(type(message)), encode(message)) for message in messages]))


def main() -> int:
    """Renew all references. 1 where a clip or a reference cannot be read."""
    parser = argparse.ArgumentParser(prog="deixis_evaluation.references", description="Renew the references of all stages.")
    parser.add_argument("clips", type=Path, metavar="CLIPS", help="folder with NAME.mp4 and NAME.json")
    parser.add_argument("references", type=Path, metavar="REFERENCES", help="folder of the references")
    given = parser.parse_args()
    try:
        given.references.mkdir(parents=True, exist_ok=True)
        for clip in load_clips(given.clips):
            for stage in REPLAYS:
                print(f"{clip.name} {stage}: {renew(clip, stage, given.references)}", flush=True)
    except (ClipError, ReferencesError, ReplayError, OSError) as error:
        print(f"references: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
