"""Sets Deixis up at a place: the camera's lens, how it is mounted, and what the tracker sees."""
