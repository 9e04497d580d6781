"""Solids measured and cut: volumes, sections, capped halves, overlaps of two."""
