"""Stored scenes: many bodies prepared once, queried by points, pairs and segments, also after some were moved."""
