"""Rendered people who point, with exact truth (optional: the five services never need it)."""
