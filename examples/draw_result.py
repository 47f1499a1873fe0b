"""Draw what Deixis saw and answered into one picture of a clip: an example of reading the recorded lines.

deixis run examples/pointing.mp4 --site examples/pointing.yaml --lockstep --out out
python examples/draw_result.py examples/pointing.mp4 out/pointing.jsonl result.png
"""

from __future__ import annotations

import argparse
import base64
import json
import math
import sys
from typing import Any

import cv2
import numpy as np

COLOURS = {"face": (80, 220, 80), "left_hand": (230, 160, 40), "right_hand": (60, 120, 250), "unknown": (160, 160, 160)}
WHITE, BLACK = (255, 255, 255), (0, 0, 0)


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("clip")
    parser.add_argument("lines", help="the .jsonl that `deixis run --out` wrote")
    parser.add_argument("picture", help="PNG to write")
    parser.add_argument("--seq", type=int, help="frame to draw (default: the last of the first pointing gesture)")
    given = parser.parse_args()
    messages = read(given.lines)
    target = next((m for m in messages["Target"].values() if m["final"]), None)
    seq = given.seq if given.seq is not None else stroke_end(messages["Gestures"])
    image = read_frame(given.clip, seq) if seq is not None else None
    if seq is None or image is None:
        print(f"{given.lines}: no pointing gesture, or {given.clip} has no such frame; choose one with --seq", file=sys.stderr)
        return 1
    image = cv2.resize(image, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    draw_tracks(image, messages["Tracks"][seq])
    draw_heads(image, messages["Tracks"][seq], messages["HeadPoses"].get(seq, {}))
    say(image, captions(messages, seq, target))
    return 0 if cv2.imwrite(given.picture, image) else 1


def read(path: str) -> dict[str, dict[int, dict[str, Any]]]:
    """Messages by type and frame number."""
    found: dict[str, dict[int, dict[str, Any]]] = {name: {} for name in ("Tracks", "HeadPoses", "Gestures", "Target")}
    with open(path, encoding="utf-8") as file:
        for line in map(json.loads, file):
            if line["type"] in found:
                found[line["type"]][line["seq"]] = line["message"]
    return found


def stroke_end(gestures: dict[int, dict[str, Any]]) -> int | None:
    """The last frame of the first run of strokes."""
    strokes = sorted(n for n, m in gestures.items() if any(g["phase"] == "stroke" for g in m["gestures"]))
    return next((n for n in strokes if n + 1 not in strokes), None)


def read_frame(clip: str, seq: int) -> Any:
    """Frame `seq` of a clip; None where it has none."""
    capture = cv2.VideoCapture(clip)
    image = None
    for _ in range(seq + 1):
        ok, image = capture.read()
        if not ok:
            return None
    return image


def draw_tracks(image: Any, tracks: dict[str, Any]) -> None:
    """Outlines and boxes."""
    for track in tracks["tracks"]:
        colour = COLOURS[track["kind"]]
        outline = np.frombuffer(base64.urlsafe_b64decode(track["contour"]), "<i2").reshape(-1, 1, 2).astype(np.int32)
        if len(outline):
            cv2.polylines(image, [outline * 2], True, colour, 2, cv2.LINE_AA)
        x, y, w, h = (round(2 * v) for v in track["bbox_px"])
        cv2.rectangle(image, (x, y), (x + w, y + h), colour, 1, cv2.LINE_AA)
        put(image, track["kind"].replace("_", " "), (x, y - 6), colour, 0.6)


def draw_heads(image: Any, tracks: dict[str, Any], poses: dict[str, Any]) -> None:
    """An arrow from each face along its yaw, as seen from above."""
    faces = {t["person_id"]: t["bbox_px"] for t in tracks["tracks"] if t["kind"] == "face"}
    for pose in poses.get("poses", ()):
        if pose["person_id"] not in faces or pose["yaw_deg"] is None:
            continue
        x, y, w, h = faces[pose["person_id"]]
        start, yaw = (2 * (x + w / 2), 2 * (y + h / 2)), math.radians(pose["yaw_deg"])
        end = (start[0] + 5 * w * math.sin(yaw), start[1] + w * math.cos(yaw))
        cv2.arrowedLine(image, tuple(map(round, start)), tuple(map(round, end)), (0, 230, 255), 3, cv2.LINE_AA, tipLength=0.12)


def captions(messages: dict[str, dict[int, dict[str, Any]]], seq: int, target: dict[str, Any] | None) -> list[str]:
    """What is written below."""
    lines = [f"frame {seq}"]
    for pose in messages["HeadPoses"].get(seq, {}).get("poses", ()):
        yaw = "" if pose["yaw_deg"] is None else f" yaw {pose['yaw_deg']:+.0f} deg +- {pose['yaw_sigma_deg']:.0f}"
        lines.append(f"head: {pose['status']}{yaw}")
    for gesture in messages["Gestures"].get(seq, {}).get("gestures", ()):
        lines.append(f"{gesture['hand']} hand: {gesture['phase']}, {gesture['gesture']}")
    if target is not None:
        best = target["pois"][0] if target["pois"] else None
        belief = f"  belief {best['belief']:.2f}, conflict {target['conflict']:.2f}" if best else ""
        lines.append(f"answer: {', '.join(target['poi_ids']) or 'none'}{belief}")
    return lines


def say(image: Any, lines: list[str]) -> None:
    """Lines of text in the lower left corner."""
    for number, line in enumerate(reversed(lines)):
        put(image, line, (16, image.shape[0] - 16 - 30 * number), WHITE, 0.8)


def put(image: Any, text: str, at: tuple[int, int], colour: tuple[int, int, int], size: float) -> None:
    """Text that can be read on any ground."""
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, BLACK, 4, cv2.LINE_AA)
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, colour, 1, cv2.LINE_AA)


if __name__ == "__main__":
    raise SystemExit(main())
