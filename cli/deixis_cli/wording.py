"""Messages in a few words, for people who watch."""

from __future__ import annotations

from collections.abc import Mapping

from deixis_schemas.messages import Belief, Gesture, Gestures, HeadPose, HeadPoses, PersonBelief, PoiBelief, Target, Tracks

Names = Mapping[str, str]

SHORT_KIND = {"face": "face", "left_hand": "left", "right_hand": "right"}
MOST_PERSONS = 3


def tracked(tracks: Tracks) -> str:
    """What is tracked, e.g. `face left right`; a person in front of each where there are several."""
    persons: dict[int | None, list[str]] = {}
    for track in tracks.tracks:
        if track.kind in SHORT_KIND and track.observed:
            persons.setdefault(track.person_id, []).append(SHORT_KIND[track.kind])
    order = list(SHORT_KIND.values())
    seen = [(person, " ".join(sorted(kinds, key=order.index))) for person, kinds in persons.items()]
    if not seen:
        return "nobody"
    if len(seen) == 1:
        return seen[0][1]
    return ", ".join(f"{'?' if person is None else f'#{person}'} {kinds}" for person, kinds in seen[:MOST_PERSONS])


def heads(poses: HeadPoses) -> str:
    """Head yaws with their sigmas, or what is wrong with them."""
    return ", ".join(_head(pose) for pose in poses.poses[:MOST_PERSONS]) or "no head"


def gestures(message: Gestures) -> str:
    """Phases and gestures of the hands."""
    return ", ".join(_gesture(gesture) for gesture in message.gestures[:MOST_PERSONS]) or "no hand"


def belief(message: Belief, names: Names) -> str:
    """The leading POI of each person, and the stages that did not answer."""
    persons = ", ".join(_person(person, names) for person in message.persons[:MOST_PERSONS]) or "-"
    return f"{persons} (without {', '.join(message.missing)})" if message.missing else persons


def answer(target: Target, names: Names) -> str:
    """The POI or POIs that a target names, each with its name where it has one."""
    return " or ".join(titled(poi_id, names) for poi_id in target.poi_ids) or "no answer"


def target_line(target: Target, names: Names) -> str:
    """A target in one line."""
    standing = {poi.poi_id: poi for poi in target.pois}
    first = standing.get(target.poi_ids[0]) if target.poi_ids else None
    figures = f"probability {chance(first):.2f}, belief {first.belief:.2f}, " if first else ""
    figures += f"contour conflict {target.contour_conflict:.2f}"
    kind = "ANSWER" if target.final else "target"
    return f"{kind} person {target.person_id}: {answer(target, names)} ({figures})"


def answer_text(target: Target, names: Names) -> str:
    """A final target in full: the answer, how each POI in it stands, the conflict and the reason."""
    standing = {poi.poi_id: poi for poi in target.pois}
    lines = [f"Person {target.person_id} points at: {answer(target, names)}"]
    for poi_id in target.poi_ids:
        if poi_id in standing:
            poi = standing[poi_id]
            lines.append(
                f"  {poi_id}: probability {chance(poi):.3f}, belief {poi.belief:.3f}, plausibility {poi.plausibility:.3f}"
            )
    return "\n".join([*lines, f"  contour conflict {target.contour_conflict:.3f}", f"  {target.reason}"])


def chance(poi: PoiBelief) -> float:
    """How probable it is that the POI is meant: what fusion says, or of others that do not say it the pignistic probability."""
    return poi.pignistic if poi.probability is None else poi.probability


def titled(poi_id: str, names: Names) -> str:
    """A POI's name with its id."""
    name = names.get(poi_id, "")
    return f"{name} ({poi_id})" if name and name != poi_id else poi_id


_POSTURES = {"index": "index finger", "open": "open palm", "fist": "fist", "thumb": "thumb"}


def _head(pose: HeadPose) -> str:
    if pose.status == "tracking" and pose.yaw_deg is not None and pose.yaw_sigma_deg is not None:
        return f"{pose.yaw_deg:+.0f}±{pose.yaw_sigma_deg:.0f}°"
    side = f" {pose.side}" if pose.side else ""
    return pose.status.replace("_", " ") + side


def _gesture(gesture: Gesture) -> str:
    if gesture.phase == "idle":
        return "idle"
    what = gesture.phase if gesture.gesture == "none" else f"{gesture.phase} {gesture.gesture}"
    if gesture.bearing_deg is not None and gesture.bearing_sigma_deg is not None:
        what += f" {gesture.bearing_deg:+.0f}±{gesture.bearing_sigma_deg:.0f}°"
    return f"{what}, {_POSTURES[gesture.hand_posture]}" if gesture.hand_posture in _POSTURES else what


def _person(person: PersonBelief, names: Names) -> str:
    if not person.pois:
        return "no POIs"
    top = max(person.pois, key=chance)
    if person.unknown > 0.999:
        return "open"
    return f"{titled(top.poi_id, names)} {chance(top):.2f}"
