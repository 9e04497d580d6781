"""Scenes that stay: many bodies prepared once, asked by points, pairs and segments, some of them moved."""
