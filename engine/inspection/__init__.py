"""Meshes that are nearly closed: what is wrong with them, and mends that are asked for."""
