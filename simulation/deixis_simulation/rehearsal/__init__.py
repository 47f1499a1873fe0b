"""Rehearsal of a site: rendered visitors point at each of its POIs, the real system answers, and advice says what to change."""
