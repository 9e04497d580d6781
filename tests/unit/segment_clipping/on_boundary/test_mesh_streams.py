"""Which triangles the segments of a group meet: those of all triangles asked one by one."""

from __future__ import annotations

import numpy as np

from engine.predicates.rational import common_integers, cross, minus
from engine.segment_clipping.exact_pieces import is_crossed, triangle_stretch
from engine.segment_clipping.on_boundary.contacts import APART, DEGENERATE, END, START
from engine.segment_clipping.on_boundary.mesh_streams import find_mesh_contacts
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, mesh_of
from engine.segment_clipping.on_boundary.triangle_contact import exact_contact
from engine.types import Point3

Floats = np.ndarray


def code_of(triangle: list[list[float]], p: list[float], q: list[float]) -> int:
    """Return the code of a triangle that is touched in one point, from integers."""
    flat, _ = common_integers([*p, *q, *(x for corner in triangle for x in corner)])
    start, end, *corners = (flat[i : i + 3] for i in range(0, 15, 3))
    stretch = triangle_stretch(start, end, *corners)
    assert stretch is not None
    t, turns = stretch[0], is_crossed(start, end, corners)
    point = [x + t * (y - x) for x, y in zip(start, end)]
    sides = [not any(cross(minus(b, a), minus(point, a))) for a, b in zip(corners, [*corners[1:], corners[0]])]
    place = START if t == 0 else END if t == 1 else corners.index(point) if point in corners else 3 + sides.index(True)
    return 2 * place + 4 + turns


def test_contacts_are_those_of_all_triangles() -> None:
    rng = np.random.default_rng(2)
    vertices = rng.integers(-8, 9, (400, 3)) / 4
    triangles = rng.integers(0, 400, (300, 3))
    triangles = triangles[[len({tuple(vertices[k]) for k in triangle}) == 3 for triangle in triangles]]
    corners = vertices[triangles]
    segments = np.concatenate([rng.integers(-12, 13, (40, 2, 3)) / 4, rng.uniform(-3, 3, (40, 2, 3))])
    segments = np.concatenate([segments, segments[:5] * 1e6])
    segments[5:15, 0], segments[10:20, 1] = vertices[:10], vertices[20:30]
    stop, room = np.zeros(1, np.uint8), 100_000

    def found(mesh: Mesh) -> tuple[Floats, Floats, Floats]:
        n_contacts, met, kinds, offsets = find_mesh_contacts(segments, mesh, stop, room)
        assert n_contacts == offsets[-1]
        return met, kinds, offsets

    met, kinds, offsets = found(mesh_of(corners, np.arange(len(corners))))
    expected: list[set[tuple[int, int]]] = [set() for _ in segments]
    for i, triangle in enumerate(corners):
        for k, segment in enumerate(segments):
            kind = exact_contact(*(Point3(*row) for row in (*triangle.tolist(), *segment.tolist())))
            if kind > DEGENERATE:
                kind = code_of(triangle.tolist(), *segment.tolist())
            if kind != APART:
                expected[k].add((i, kind))
    assert any(expected)
    for k, pairs in enumerate(expected):
        mine = slice(offsets[k], offsets[k + 1])
        assert set(zip(met[mine].tolist(), kinds[mine].tolist())) == pairs
