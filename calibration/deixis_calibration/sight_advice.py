"""What is to be said of what the tracker sees, and what to do: numbers in, findings of `deixis doctor --camera` out."""

from __future__ import annotations

from collections.abc import Iterator

from deixis_runtime.finding import Finding

from .looking import FaceMeasures, Seen

DARK, DARK_FACE, BRIGHT_FACE = 40.0, 45.0, 235.0
BURNT_SHARE = 0.3
DIM = 90.0
"""Of dark skin in good light the face may be darker than DARK_FACE, but not the picture darker than this."""
BACK_LIGHT, BACK_LIGHT_FACE = 100.0, 0.25
"""A picture brighter than this, with a face of so little of its light. Dark skin in good light may have as little."""
BLURRED = 0.5
"""Pictures that ship and ours of real people have 0.11 to 0.33; the same under a blur of 2.5 pixels and more go beyond this."""
LEAST_FACE_PX, SMALL_FACE_PX = 22.0, 32.0
"""Below the first a new face is rarely found; below the second fingers are two pixels wide."""
SKIN_ELSEWHERE = 0.1
LIGHT = "light the person from the front, or let the camera expose longer"


def advise(seen: Seen) -> Iterator[Finding]:
    """Findings, of the picture first, then of the people in it."""
    yield from of_light(seen)
    yield from of_sharpness(seen)
    yield from of_colour(seen)
    yield from of_faces(seen)
    yield from of_hands(seen)


def of_light(seen: Seen) -> Iterator[Finding]:
    """Too dark, too bright, or from behind."""
    picture, face = seen.picture, _largest(seen)
    if face is None and picture.light < DARK:
        yield Finding("wrong", f"the picture is too dark: brightness {picture.light:.0f} of 255", LIGHT)
    elif face is not None and picture.light > BACK_LIGHT and face.light < BACK_LIGHT_FACE * picture.light:
        what = f"the face is much darker than the rest: brightness {face.light:.0f} of {picture.light:.0f}"
        advice = "no fault with dark skin; but is the light behind the person? Then turn the camera away from the window"
        yield Finding("note", what, advice)
    elif face is not None and face.light < DARK_FACE and picture.light < DIM:
        yield Finding("wrong", f"the face is too dark: brightness {face.light:.0f} of 255", LIGHT)
    elif face is not None and face.light > BRIGHT_FACE:
        yield Finding("wrong", f"the face is overexposed: brightness {face.light:.0f} of 255", "let the camera expose shorter")
    if picture.burnt > BURNT_SHARE:
        what = f"the picture is overexposed: {100 * picture.burnt:.0f} % of it is white"
        yield Finding("note", what, "let the camera expose shorter, or turn it away from the window")


def of_sharpness(seen: Seen) -> Iterator[Finding]:
    """Out of focus, a lens that is covered or dirty."""
    picture = seen.picture
    advice = "focus the lens, wipe it, and stand it still"
    if picture.blur is None and picture.light >= DARK:
        yield Finding("wrong", "the picture has no edges: the lens is covered, or far out of focus", advice)
    elif picture.blur is not None and picture.blur > BLURRED:
        yield Finding("wrong", f"the picture is blurred: {picture.blur:.2f}, sharp ones have 0.1 to 0.35", advice)


def of_colour(seen: Seen) -> Iterator[Finding]:
    """A grey camera, or a room the colour of skin."""
    if seen.picture.grey and seen.picture.light >= DARK:
        yield Finding("wrong", "the picture is grey: hands are found by their shape alone, and few", "take a colour camera")
    elif seen.skin_elsewhere > SKIN_ELSEWHERE:
        what = f"{100 * seen.skin_elsewhere:.0f} % of the picture passes for skin and is nobody's"
        yield Finding(
            "note", what, "a white balance that is too warm, or wood and walls: the tracker learns them while it runs"
        )


def of_faces(seen: Seen) -> Iterator[Finding]:
    """Whether somebody is seen, and large enough."""
    face = _largest(seen)
    if face is None:
        advice = "stand upright before the camera and face it, two metres away; move a little"
        yield Finding("wrong", f"no face found in {seen.frames} pictures", advice)
        return
    width = f"face {face.width_px:.0f} px wide"
    if face.width_px < LEAST_FACE_PX:
        yield Finding("wrong", f"{width}: too small", "come nearer, or take pictures of more pixels or a narrower lens")
    elif face.width_px < SMALL_FACE_PX:
        yield Finding("note", f"{width}: small, hands will often be missed", "come nearer, or take more pixels")
    else:
        others = f", {len(seen.faces) - 1} more" if len(seen.faces) > 1 else ""
        yield Finding("ok", f"{width}{others}, brightness {face.light:.0f}")
    yield from _at_the_edge(seen, face)


def of_hands(seen: Seen) -> Iterator[Finding]:
    """Whether hands are seen of somebody who is."""
    if not seen.faces:
        return
    if seen.hands == 0:
        yield Finding(
            "note", "no hand found", "raise one beside the body, sleeve or not; look whether skin is white in the picture"
        )
    else:
        yield Finding("ok", f"{seen.hands} hands seen at once")


def _at_the_edge(seen: Seen, face: FaceMeasures) -> Iterator[Finding]:
    """An arm stretched to the side is some four face widths long."""
    x, _, width, _ = face.box
    sides = {"left": x / width, "right": (seen.image.shape[1] - x - width) / width}
    near = [side for side, widths in sides.items() if widths < 2]
    if near:
        what = f"the face is near the picture's {' and '.join(near)} edge: a hand pointing there leaves the picture"
        yield Finding("note", what, "stand in the middle, farther away, or take a wider lens")


def _largest(seen: Seen) -> FaceMeasures | None:
    return max(seen.faces, key=lambda face: face.width_px, default=None)
