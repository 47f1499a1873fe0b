"""How large people's heads are: what turns pixels into metres, the same for every stage.

Means of adults. A stage that has another face box publishes it scaled to this width, and others need not know.
"""

from __future__ import annotations

FACE_WIDTH_M = 0.164
"""Breadth of the face from the front, ear to ear, the ears included: the width of a face's `bbox_px`."""

HEAD_WIDTH_M = 0.182
"""Breadth of the head's outline from the front, hair included."""
