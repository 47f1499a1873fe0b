"""Makes `deixis_conformance/small.mcap`, what `deixis check-stage` feeds, from the shipped clip of that name:

    .venv/bin/python conformance/make_recording.py

Run it when a message changes that stages are fed with (the tests say so). Only what stages listen to is kept, and nothing of
the machine.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from deixis_cli.mcap_file import McapReader, McapRecorder
from deixis_cli.raw_message import RawMessage
from deixis_evaluation.clips import load_clips
from deixis_evaluation.truth_site import write_site
from deixis_schemas import codec, topics
from deixis_schemas.messages import CameraInfo

ROOT = Path(__file__).resolve().parents[1]
CLIP = "small"
KEPT = {topic for inputs in topics.INPUTS.values() for topic in inputs}
QUALITY = 70


def main() -> int:
    """Play the clip in lockstep, and keep what stages are fed with."""
    (clip,) = load_clips(ROOT / "examples" / "clips", CLIP)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        site = write_site(clip, folder)
        run = [
            Path(sys.executable).parent / "deixis",
            "run",
            ROOT / "examples" / "clips" / f"{CLIP}.mp4",
            "--site",
            site,
            "--lockstep",
        ]
        run += ["--out", folder, "--pictures", "--set", "camera.encoding=jpeg", "--set", f"camera.quality={QUALITY}"]
        subprocess.run([*map(str, run), "--listen", "tcp/127.0.0.1:0"], check=True)
        (kept := ROOT / "conformance" / "deixis_conformance" / f"{CLIP}.mcap").unlink(missing_ok=True)
        with McapRecorder(kept) as recorder:
            for message in McapReader(folder / f"{CLIP}.mcap"):
                if topics.topic_of(message.key) in KEPT:
                    recorder.write(_of_no_machine(message))
    return 0


def _of_no_machine(raw: RawMessage) -> RawMessage:
    if topics.topic_of(raw.key) is not topics.CAMERA_INFO:
        return raw
    info = codec.decode(CameraInfo, raw.payload, raw.encoding).model_copy(update={"source": f"{CLIP}.mp4"})
    return RawMessage(raw.key, raw.encoding, codec.encode(info), raw.received_ns)


if __name__ == "__main__":
    raise SystemExit(main())
