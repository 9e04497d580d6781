"""Chords of meshes that are tiny and far from the origin: what a line crosses before it starts is not lost."""

from __future__ import annotations

import numpy as np

import engine
from engine.running.budget import UNLIMITED
from engine.segment_clipping.profiles import clip_exactly

CORNERS = np.array([[x, y, z] for x in (0, 4) for y in (0, 4) for z in (0, 4)], np.float64)
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                  [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip


def test_chords_of_cubes_of_a_billionth_a_million_away() -> None:
    scale, draw = 2.0**-31, np.random.default_rng(3)
    cubes = [CORNERS + np.array([shift, other, 0]) for shift, other in ((0, 0), (8, 0), (0, 8))]
    vertices = np.concatenate(cubes) * scale + 1e6 * np.array([1, -1, 1])
    faces = np.concatenate([FACES, FACES + 8, FACES + 16])
    a, b, c = vertices[faces[draw.integers(len(faces), size=2_000)]].swapaxes(0, 1)
    i, j = draw.integers(0, 3, (2, 2_000, 1)) / 4
    segments = (a + (b - a) * i + (c - a) * j).reshape(-1, 2, 3)
    solid = engine.Polyhedron(vertices, faces)
    pieces = engine.clip_segments(segments, solid)
    expected = clip_exactly(segments, np.arange(len(segments)), solid, None, UNLIMITED)
    for name in ("source", "t", "faces"):
        np.testing.assert_array_equal(getattr(pieces, name), getattr(expected, name))
