"""What the messages of a stage say, field by field, for comparison."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import cv2
import numpy as np
from deixis_schemas.messages import Belief, Gestures, HeadPose, HeadPoses, Message, OfFrame, Target, Track, Tracks

Value = str | float | tuple[float, ...]
Stated = dict[str, dict[str, Value]]
"""What is said of a frame: for each field, the value of each subject (a hand, a person, a POI)."""


def statements(messages: Sequence[Message]) -> dict[int, Stated]:
    """What a stage's messages say, by `seq`; the answers to a clip stand with its last frame."""
    frames: dict[int, Stated] = {}
    for message in messages:
        if isinstance(message, OfFrame) and type(message) in SAID_BY:
            frames[message.seq] = SAID_BY[type(message)](message)
    beliefs = [message for message in messages if isinstance(message, Belief)]
    if beliefs:
        finals = [message for message in messages if isinstance(message, Target) and message.final]
        frames[beliefs[-1].seq] |= _say_answers(finals, beliefs[0].stamp_ns)
    return frames


def _say_tracks(message: Tracks) -> Stated:
    tracks = _subjects(message.tracks)
    frontal = {name: track.frontal for name, track in tracks.items() if track.frontal is not None}
    outlines = {name: track.contour for name, track in tracks.items() if track.contour}
    return {
        "tracks": {"the frame": ", ".join(sorted(tracks)) or "nothing"},
        "centre_px": {name: _centre(*track.bbox_px) for name, track in tracks.items()},
        "size_px": {name: track.bbox_px[2:] for name, track in tracks.items()},
        "contour_area_px": {name: _area(outline) for name, outline in outlines.items()},
        "frontal": {name: "seen" if name in frontal else "not seen" for name in tracks},
        "frontal_centre_px": {name: face.centre_px for name, face in frontal.items()},
        "frontal_width_px": {name: face.width_px for name, face in frontal.items()},
    }


def _subjects(tracks: Iterable[Track]) -> dict[str, Track]:
    """Tracks by kind and person: their ids are no property of the picture. Of two alike the one further left comes first."""
    named: dict[str, Track] = {}
    for track in sorted(tracks, key=lambda track: track.centroid_px):
        name = f"{track.kind} of " + ("nobody" if track.person_id is None else f"person {track.person_id}")
        while name in named:
            name += "'"
        named[name] = track
    return named


def _centre(x: float, y: float, width: float, height: float) -> tuple[float, float]:
    return x + width / 2, y + height / 2


def _area(contour: bytes) -> float:
    return cv2.contourArea(np.frombuffer(contour, "<i2").reshape(-1, 1, 2).astype(np.int32))


def _say_poses(message: HeadPoses) -> Stated:
    persons = {f"person {pose.person_id}": pose for pose in message.poses}
    stated = {name: sigmas for name, pose in persons.items() if (sigmas := _sigmas(pose)) is not None}
    return {
        "persons": {"the frame": _names(persons)},
        "status": {name: pose.status for name, pose in persons.items()},
        "side": {name: pose.side or "not said" for name, pose in persons.items()},
        "yaw_deg": {name: pose.yaw_deg for name, pose in persons.items() if pose.yaw_deg is not None},
        "yaw_sigma_deg": {name: pose.yaw_sigma_deg for name, pose in persons.items() if pose.yaw_sigma_deg is not None},
        "pitch_deg": {name: pose.pitch_deg for name, pose in persons.items() if pose.pitch_deg is not None},
        "roll_deg": {name: pose.roll_deg for name, pose in persons.items() if pose.roll_deg is not None},
        "pitch_sigma_deg": {name: sigmas[1] for name, sigmas in stated.items()},
        "roll_sigma_deg": {name: sigmas[2] for name, sigmas in stated.items()},
    }


def _sigmas(pose: HeadPose) -> tuple[float, float, float] | None:
    """Of yaw, pitch and roll, degrees; none where the covariance is not stated."""
    if pose.covariance_deg2 is None:
        return None
    of_yaw, _, _, of_pitch, _, of_roll = pose.covariance_deg2
    return of_yaw**0.5, of_pitch**0.5, of_roll**0.5


def _say_gestures(message: Gestures) -> Stated:
    persons = {f"person {gesture.person_id}": gesture for gesture in message.gestures}
    return {
        "persons": {"the frame": _names(persons)},
        "phase": {name: gesture.phase for name, gesture in persons.items()},
        "gesture": {name: gesture.gesture for name, gesture in persons.items()},
        "hand": {name: gesture.hand or "none" for name, gesture in persons.items()},
        "bearing_deg": {name: item.bearing_deg for name, item in persons.items() if item.bearing_deg is not None},
        "bearing_sigma_deg": {
            name: item.bearing_sigma_deg for name, item in persons.items() if item.bearing_sigma_deg is not None
        },
    }


def _say_belief(message: Belief) -> Stated:
    persons = {f"person {person.person_id}": person for person in message.persons}
    return {
        "persons": {"the frame": _names(persons)},
        "pointing": {name: "no" if person.episode_id is None else "yes" for name, person in persons.items()},
        "distance_m": {name: person.distance_m for name, person in persons.items() if person.distance_m is not None},
        "unknown": {name: person.unknown for name, person in persons.items()},
        "conflict": {name: person.conflict for name, person in persons.items()},
        "pignistic": {f"{poi.poi_id} of {name}": poi.pignistic for name, person in persons.items() for poi in person.pois},
        "probability": {
            f"{poi.poi_id} of {name}": poi.probability
            for name, person in persons.items()
            for poi in person.pois
            if poi.probability is not None
        },
        "evidence_weight": {
            f"{item.source} of {name}": item.weight for name, person in persons.items() for item in person.evidence
        },
    }


def _say_answers(finals: Sequence[Target], start_ns: int) -> Stated:
    said = [f"{', '.join(target.poi_ids) or 'no POI'} for person {target.person_id}" for target in finals]
    times = [((target.started_ns - start_ns) / 1e9, (target.ended_ns - start_ns) / 1e9) for target in finals]
    return {
        "answers": {"the clip": "; ".join(said) or "none"},
        "answer_from_to_s": {f"answer {number}": time for number, time in enumerate(times, 1)},
    }


SAID_BY: dict[type[Message], Callable[..., Stated]] = {
    Tracks: _say_tracks,
    HeadPoses: _say_poses,
    Gestures: _say_gestures,
    Belief: _say_belief,
}


def _names(subjects: Iterable[str]) -> str:
    return ", ".join(sorted(subjects)) or "nobody"
