"""Shows what Deixis sees, and why it answers as it does."""
