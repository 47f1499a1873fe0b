"""A face as a tracker tells it, where a test needs no more of it than its place and width."""

from deixis_schemas.messages import KindProbabilities, Track


def face_track(x: float, y: float, width: float) -> Track:
    """Of person 1, square, its middle at (x, y) and so wide, pixels."""
    return Track(
        track_id=1,
        person_id=1,
        kind="face",
        kind_probabilities=KindProbabilities(face=1.0),
        centroid_px=(x, y),
        bbox_px=(x - (width - 1) / 2, y - (width - 1) / 2, width, width),
        velocity_px_s=(0, 0),
    )
