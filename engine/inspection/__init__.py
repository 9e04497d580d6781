"""Meshes that are nearly closed: what is wrong with them, and mends by option."""
