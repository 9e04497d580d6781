"""Which triangles the segments of a group meet: those of all triangles, one by one. Segments in the coordinates of
a tree: within their slack of where they are, however far they reach.
"""

from __future__ import annotations

import numpy as np

from engine.predicates.rational import common_integers, cross, minus
from engine.segment_clipping.exact_pieces import is_crossed, triangle_overlap
from engine.segment_clipping.on_boundary.contacts import Kind, Place
from engine.segment_clipping.on_boundary.descent import LIMIT, local_segment
from engine.segment_clipping.on_boundary.mesh_contacts import find_contacts_3d
from engine.segment_clipping.on_boundary.prepared_boundary import Mesh, mesh_of
from engine.segment_clipping.on_boundary.triangle_contacts import exact_contact
from engine.types import Point3
from tests.unit.segment_clipping.on_boundary.test_contacts import overlap_codes

Floats = np.ndarray


def codes_of(triangle: list[list[float]], p: list[float], q: list[float]) -> list[int]:
    """Return the codes of a triangle that is touched, from integers."""
    flat, _ = common_integers([*p, *q, *(x for corner in triangle for x in corner)])
    start, end, *corners = (flat[i : i + 3] for i in range(0, 15, 3))
    stretch = triangle_overlap(start, end, *corners)
    assert stretch is not None
    if stretch[2]:
        return overlap_codes([*start], [*end], [[*corner] for corner in corners], *stretch[:2])
    t, turns = stretch[0], is_crossed(start, end, corners)
    point = [x + t * (y - x) for x, y in zip(start, end)]
    sides = [not any(cross(minus(b, a), minus(point, a))) for a, b in zip(corners, [*corners[1:], corners[0]])]
    place = (
        Place.START
        if t == 0
        else Place.END
        if t == 1
        else corners.index(point)
        if point in corners
        else 3 + sides.index(True)
    )
    return [2 * place + 4 + turns]


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
        n_contacts, met, kinds, offsets = find_contacts_3d(segments, mesh, 0.0, stop, room)
        assert n_contacts == offsets[-1]
        return met, kinds, offsets

    met, kinds, offsets = found(
        mesh_of(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), np.arange(len(corners)))
    )
    expected: list[set[tuple[int, int]]] = [set() for _ in segments]
    for i, triangle in enumerate(corners):
        for k, segment in enumerate(segments):
            kind = exact_contact(*(Point3(*row) for row in (*triangle.tolist(), *segment.tolist())), False)
            if kind > Kind.DEGENERATE:
                expected[k] |= {(i, code) for code in codes_of(triangle.tolist(), *segment.tolist())}
            elif kind != Kind.APART:
                expected[k].add((i, kind))
    assert any(expected)
    for k, pairs in enumerate(expected):
        mine = slice(offsets[k], offsets[k + 1])
        assert set(zip(met[mine].tolist(), kinds[mine].tolist())) == pairs


def test_middle_and_half_are_within_their_slack() -> None:
    rng = np.random.default_rng(1)
    origin, inverse = np.array([3.0, -1.0, 100.0]), np.array([0.25, 0.5, 0.125])
    for size in (1e-6, 1.0, 8.0, 1e4):
        for _ in range(20):
            p = origin + rng.uniform(-1, 1, 3)  # near the tree: what is cut off lies far from it
            q = p + rng.uniform(-size, size, 3)
            middle, half, _, slack, is_near = local_segment(Point3(*p), Point3(*q), origin, inverse, 0.0)
            local_p, local_q = (p - origin) * inverse, (q - origin) * inverse
            ends = np.array(middle, float) - np.array(half, float), np.array(middle, float) + np.array(half, float)
            assert is_near
            assert np.abs(ends[0] - local_p).max() <= slack
            if np.abs(local_q).max() <= LIMIT:
                assert np.abs(ends[1] - local_q).max() <= slack
            else:
                assert np.abs(ends[1]).max() >= LIMIT - slack


def test_segments_that_pass_far_away_are_not_near() -> None:
    assert not local_segment(Point3(10.0, -9.0, 0.0), Point3(10.0, 9.0, 0.0), np.zeros(3), np.ones(3), 0.0)[-1]
