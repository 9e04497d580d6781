"""Hits of segments and rays: each kind by hand, a seeded sample against rationals, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import engine
from engine import HitKind
from tests.reference import hits as reference
from tests.reference.exact import Q, add, sub, vector

CORNERS = [[x, y, z] for x in (0.0, 4.0) for y in (0.0, 4.0) for z in (0.0, 4.0)]
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
CUBE = engine.Polyhedron(CORNERS, QUADS)
SHEET = engine.Surface([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[0, 1, 2], [0, 2, 3]])
TENT = engine.Surface([[0, 0, 0], [4, 0, 0], [4, 2, 2], [0, 2, 2], [0, 4, 0], [4, 4, 0]], [[0, 1, 2, 3], [3, 2, 5, 4]])
TWICE = engine.Surface(SHEET.vertices, [[0, 1, 2], [0, 2, 3], [1, 2, 3], [1, 3, 0]])
FLAT = engine.Surface([[0, 0, 0], [2, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2], [0, 2, 3]])
"""The side from 0 to 4 of the triangle has another, without area."""


def names(found: engine.Hits) -> list[tuple[float, float, int, str]]:
    rows = zip(found.t.tolist(), found.t_end.tolist(), found.face.tolist(), found.kind.tolist())
    return [(t, t_end, face, HitKind(kind).name) for t, t_end, face, kind in rows]


@pytest.mark.parametrize(
    ("surface", "segment", "expected"),
    [
        (SHEET, [[1, 2, 1], [1, 2, -1]], [(0.5, 0.5, 1, "ACROSS")]),
        (SHEET, [[2, 2, 1], [2, 2, -1]], [(0.5, 0.5, 0, "ACROSS")]),  # the side that both have
        (SHEET, [[0, 2, 1], [0, 2, -1]], [(0.5, 0.5, 1, "RIM")]),
        (SHEET, [[4, 4, 1], [4, 4, -1]], [(0.5, 0.5, 0, "RIM")]),
        (SHEET, [[1, 2, 1], [1, 2, 0]], [(1.0, 1.0, 1, "END")]),
        (SHEET, [[1, 2, 0], [1, 2, 3]], [(0.0, 0.0, 1, "END")]),
        (SHEET, [[-4, 2, 0], [4, 2, 0]], [(0.5, 1.0, 1, "ALONG")]),
        (SHEET, [[1, 2, 0], [1, 2, 0]], [(0.0, 0.0, 1, "END")]),
        (SHEET, [[1, 2, 1], [1, 2, 1]], []),
        (TENT, [[2, 1, 2], [2, 3, 2]], [(0.5, 0.5, 0, "TOUCH")]),
        (TENT, [[2, 0, 1], [2, 4, 1]], [(0.25, 0.25, 0, "ACROSS"), (0.75, 0.75, 1, "ACROSS")]),
        (TENT, [[0, 2, 2], [4, 2, 2]], [(0.0, 1.0, 0, "ALONG")]),
        (TWICE, [[1, 2, 1], [1, 2, -1]], [(0.5, 0.5, 1, "TOUCH")]),  # two sheets, crossed both
        (FLAT, [[2, 0, 1], [2, 0, -1]], [(0.5, 0.5, 1, "RIM")]),
        (CUBE, [[-4, 1, 1], [8, 1, 1]], [(1 / 3, 1 / 3, 0, "ACROSS"), (2 / 3, 2 / 3, 1, "ACROSS")]),

        (CUBE, [[-1, 1, 2], [1, -1, 2]], [(0.5, 0.5, 0, "TOUCH")]),
        (CUBE, [[-1, -1, -1], [9, 9, 9]], [(0.1, 0.1, 0, "ACROSS"), (0.5, 0.5, 1, "ACROSS")]),  # from corner to corner
        (CUBE, [[-1, 1, 4], [9, 1, 4]], [(0.1, 0.5, 0, "ALONG")]),
    ],
)  # fmt: skip
def test_kinds(surface: Any, segment: Any, expected: list[tuple[float, float, int, str]]) -> None:
    assert names(engine.hits([segment], surface)) == expected
    assert names(engine.hits([segment], surface, keep="first")) == expected[:1]
    assert engine.hits([segment], surface, keep="any").tolist() == [bool(expected)]


def test_a_ray_has_no_far_end() -> None:
    origins, directions = [[1, 2, 2.0**60], [1, 2, 5], [1, 2, 5]], [[0, 0, -(2.0**-60)], [0, 0, 1], [0, 0, 0]]
    found = engine.hits(np.stack([origins, directions], axis=1), SHEET, rays=True)
    assert (found.source.tolist(), found.t.tolist()) == ([0], [2.0**120])
    with pytest.raises(engine.NotRepresentableError):
        engine.hits([[[1, 2, 1e300], [0, 0, -1e-300]]], SHEET, rays=True)


def test_normals_are_unit_vectors_of_the_faces_order() -> None:
    found = engine.hits([[[-1, 1, 1], [9, 1, 1]], [[1, 1, 9], [1, 1, -1]]], CUBE)
    assert found.normal.tolist() == [[-1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 0, -1]]
    askew = engine.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 1]], [[0, 2, 1]])
    assert engine.hits([[[0.25, 0.25, 9], [0.25, 0.25, -9]]], askew).normal.tolist() == [[0.0, 0.5**0.5, -(0.5**0.5)]]
    line = engine.Surface([[0, 0, 0], [1, 0, 0], [3, 0, 0]], [[0, 1, 2]])
    found = engine.hits([[[2, 0, 1], [2, 0, -1]]], line)
    assert (found.normal.tolist(), found.barycentric.tolist()) == ([[0, 0, 0]], [[0, 0.5, 0.5]])


def meshes() -> dict[str, tuple[Any, Any]]:
    """Return vertices and triangles of small meshes with every degeneracy."""
    draw = np.random.default_rng(7)
    cube = np.array(CORNERS), [[q[0], *pair] for q in QUADS for pair in (q[1:3], q[2:4])]
    grid = np.array([[x, y, draw.integers(0, 3)] for x in range(4) for y in range(4)], np.float64)
    tin = [t for k in (0, 1, 2, 4, 5, 6, 8, 9, 10) for t in ([k, k + 4, k + 5], [k, k + 5, k + 1])]
    plain = grid * [1, 1, 0]
    soup = draw.integers(-3, 4, (12, 3)).astype(float), [draw.choice(12, 3, False).tolist() for _ in range(12)]
    half = np.vstack([grid, (grid[0] + grid[4]) / 2, grid[0]])
    stack = np.concatenate([cube[0], np.add(cube[0], [4, 0, 0]), np.add(cube[0], [0, 4, 0])])
    stacked = stack, [[8 * k + i for i in each] for k in range(3) for each in cube[1]]  # faces flush
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    odd = [*tin, tin[0], [0, 16, 5], [0, 16, 4], [0, 17, 4]]  # twice, cut elsewhere, without area, a side of no length
    return {
        "cube": cube, "terrain": (grid, tin), "plane": (plain, tin), "soup": soup, "odd": (half, odd),
        "stretched": (grid * [1.0, 2.0**-30, 12345.678], tin), "far": (0.1 * half + [1e6, -1e6, 1e6], odd),
        "denormal": (5e-324 * cube[0], cube[1]), "huge": (1e300 * cube[0], cube[1]), "decimal": (cube[0] / 3, cube[1]),
        "stacked": stacked, "turned": (stacked[0] @ turn, stacked[1]),
    }  # fmt: skip


MESHES = meshes()


def lines_through(vertices: Any, triangles: Any, n: int, seed: int) -> Any:
    """Return segments through corners and sides, in planes, that end there, and others."""
    draw, found = np.random.default_rng(seed), []
    low, extent = vertices.min(axis=0), np.maximum(np.ptp(vertices, axis=0), np.ptp(vertices, axis=0).max() * 2.0**-9)
    for k in range(n):
        a, b, c = vertices[triangles[draw.integers(len(triangles))]]
        p, q = (low + extent * draw.integers(-2, 7, 3) / 4 for _ in range(2))
        inside, other = (a + (b - a) * i / 4 + (c - a) * j / 4 for i, j in draw.integers(-1, 6, (2, 2)))
        found.append(
            [(p, q), (p, a), (p, (a + b) / 2), (inside, other), (a, q), (inside, q), (p, inside), (a - (b - a), b),
             (a, a)][k % 9]
        )  # fmt: skip
    return np.array(found) + 0.0


@pytest.mark.parametrize("name", ["stacked", "turned"])
def test_flush_faces_are_crossed_without_integers(name: str) -> None:
    surface, draw = engine.Surface(*MESHES[name]), np.random.default_rng(3)
    centre, size = surface.vertices.mean(axis=0), np.ptp(surface.vertices, axis=0).max()
    lines = centre + size * draw.uniform(-1, 1, (200, 2, 3))
    found, accuracy = engine.hits(lines, surface, report=True)
    assert accuracy.n_rational == 0
    assert len({*zip(found.source.tolist(), found.t.tolist())}) == len(found)  # two sheets are one hit
    _, accuracy = engine.Scene([surface]).clip_segments(lines, report=True)
    assert accuracy.n_rational == 0


@pytest.mark.parametrize("is_ray", [False, True])
@pytest.mark.parametrize("name", MESHES)
def test_equal_to_rationals(name: str, is_ray: bool) -> None:
    surface = engine.Surface(*MESHES[name])
    lines = lines_through(surface.vertices, surface.triangles, 27, 5)
    if is_ray:
        lines[:, 1] -= lines[:, 0]
    triangles = [[vector(corner) for corner in each] for each in surface.vertices[surface.triangles].tolist()]
    found, first = engine.hits(lines, surface, rays=is_ray), engine.hits(lines, surface, rays=is_ray, keep="first")
    any_of = engine.hits(lines, surface, rays=is_ray, keep="any")
    for k, (p, q) in enumerate(lines.tolist()):
        way = vector(q) if is_ray else sub(vector(q), vector(p))
        expected = reference.hits(vector(p), way, is_ray, triangles, surface.triangle_faces.tolist())
        rows = [
            (*map(float, each[:2]), each.triangle, each.kind, [float(weight) for weight in each.weights])
            for each in expected
        ]
        for answer, wanted in ((found, rows), (first, rows[:1])):
            columns = (answer.t, answer.t_end, answer.triangle, answer.kind, answer.barycentric)
            mine = [column[answer.source == k].tolist() for column in columns]
            assert list(zip(*mine)) == wanted, (name, p, q)
        assert any_of[k] == bool(rows)


def test_lines_in_the_planes_of_faces_take_no_integers() -> None:
    draw = np.random.default_rng(19)
    for name, axis, level in (("plane", 2, 0.0), ("cube", 0, 4.0), ("cube", 1, 0.0)):
        surface = engine.Surface(*MESHES[name])
        lines = draw.uniform(-1, 5, (300, 2, 3))
        lines[::3, 1] = np.round(lines[::3, 1])
        lines[:, :, axis] = level
        _, accuracy = engine.hits(lines, surface, report=True)
        assert accuracy.n_rational == 0


def test_different_points_at_parameters_that_round_alike_take_no_rationals() -> None:
    draw = np.random.default_rng(2)
    grid = np.array([[x, y, draw.integers(0, 3)] for x in range(30) for y in range(30)], np.float64)
    k = np.arange(870)[np.arange(870) % 30 < 29]
    surface = engine.Surface(grid, np.concatenate([np.stack([k, k + 30, k + 31], 1), np.stack([k, k + 31, k + 1], 1)]))
    lines = draw.integers(0, 29, (300, 2, 3)) * [1.0, 1.0, 0.05]
    _, accuracy = engine.hits(lines, surface, report=True)
    assert accuracy.n_rational == 0


def images_under(pose: engine.Pose, surface: Any) -> list[Any]:
    """Return the corners of the triangles of a surface under a pose, as fractions."""
    rotation = [vector(row) for row in pose.rotation.tolist()]
    return [
        [add(tuple(sum((x * y for x, y in zip(row, vector(corner))), Q(0)) for row in rotation),
             vector(pose.translation.tolist())) for corner in each]
        for each in surface.vertices[surface.triangles].tolist()
    ]  # fmt: skip


def test_ends_near_a_placed_surface_of_lines_that_begin_far_away() -> None:
    """Signs are proven there while t is not: it was taken for less, or more, than 1."""
    turned, draw = engine.Pose.from_quaternion([3, 1, 2, -1], [0.3, -7, 2]), np.random.default_rng(11)
    surface = engine.Surface(*MESHES["terrain"])
    images, scene = images_under(turned, surface), engine.Scene([surface], [turned])
    corners = np.array([[[float(x) for x in corner] for corner in each] for each in images])
    targets = np.einsum("nk,nkj->nj", draw.dirichlet([1, 1, 1], 120), corners[draw.integers(len(corners), size=120)])
    ways = draw.normal(size=(120, 3)) * 10.0 ** draw.uniform(6, 13, (120, 1))
    beyond = draw.choice([-1, 1], (120, 1)) * 10.0 ** -draw.uniform(0, 8, (120, 1))
    ends = targets + ways / abs(ways).max(axis=1, keepdims=True) * beyond
    lines = np.stack([targets + ways, ends], axis=1)
    found, first, any_of = scene.hits(lines), scene.hits(lines, keep="first"), scene.hits(lines, keep="any")
    for k, (p, q) in enumerate(lines.tolist()):
        expected = reference.hits(vector(p), sub(vector(q), vector(p)), False, images, surface.triangle_faces.tolist())
        rows = [(float(each.t), each.triangle, each.kind) for each in expected]
        for answer, wanted in ((found, rows), (first, rows[:1])):
            columns = (answer.t, answer.triangle, answer.kind)
            assert list(zip(*(column[answer.source == k].tolist() for column in columns))) == wanted
        assert any_of[k] == bool(rows)


def test_small_bodies_whose_own_coordinates_are_large() -> None:
    """Tails of starts were left out of where lines enter the tree: hits were lost."""
    far, draw = np.array([3e12, -2e12, 1e12]), np.random.default_rng(3)
    turned = engine.Pose.from_quaternion([3, 1, 2, -1])
    turned = engine.Pose(turned.rotation, -turned.rotation @ far)
    surface = engine.Surface(TRIANGLE * 2.0**-9 + far, [[0, 1, 2]])
    images = images_under(turned, surface)
    corners = np.array([[float(x) for x in corner] for corner in images[0]])
    lines = (draw.dirichlet([1, 1, 1], 60) @ corners)[:, None] + draw.normal(size=(60, 1, 3)) * [
        [[2.0**-9], [-(2.0**-9)]]
    ]
    found = engine.Scene([surface], [turned]).hits(lines)
    expected = exact_rows(lines.tolist(), [images], False)
    assert expected
    assert [*zip(found.source.tolist(), found.t.tolist())] == [(source, float(t)) for source, _, t in expected]


def test_poses_are_exact() -> None:
    turned = engine.Pose.from_quaternion([3, 1, 2, -1], [0.3, -7, 1e3])
    surface = engine.Surface(*MESHES["odd"])
    images = images_under(turned, surface)
    corners = np.array([[[float(x) for x in corner] for corner in each] for each in images]).reshape(-1, 3)
    lines = lines_through(corners, np.arange(len(corners)).reshape(-1, 3), 27, 6)
    found = engine.Scene([CUBE, surface], [None, turned]).hits(lines)
    assert len(found) > 9
    assert set(found.body.tolist()) == {1}
    for k, (p, q) in enumerate(lines.tolist()):
        expected = reference.hits(vector(p), sub(vector(q), vector(p)), False, images, surface.triangle_faces.tolist())
        rows = [(float(each.t), float(each.t_end), each.triangle, each.kind) for each in expected]
        columns = (found.t, found.t_end, found.triangle, found.kind)
        assert list(zip(*(column[found.source == k].tolist() for column in columns))) == rows
    lengths = [sum(Q(x) ** 2 for x in row) for row in found.normal.tolist()]
    assert all(abs(length - 1) < Q(1, 2**50) or length == 0 for length in lengths)


def test_bodies_that_are_met_at_one_place_stand_in_their_order() -> None:
    beside = engine.Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [4, 0, 0])
    scene = engine.Scene([SHEET, SHEET, CUBE], [beside, None, None])
    found = scene.hits([[[1, 2, -3], [1, 2, 6]]])
    assert (found.body.tolist(), found.t.tolist()) == ([0, 1, 2, 2], [1 / 3, 1 / 3, 1 / 3, 7 / 9])
    assert scene.hits([[[1, 2, -3], [1, 2, 6]]], keep="first").body.tolist() == [0]
    assert scene.moved({0: None, 1: beside}).hits([[[1, 2, 1], [1, 2, 0.5]]]).body.tolist() == []
    with pytest.raises(engine.UnsupportedSolidError, match=r"solids\[1\]: hits does not take a sphere"):
        engine.Scene([SHEET, engine.Sphere([0, 0, 0], 1)]).hits([[[1, 2, 1], [1, 2, 0]]])


@pytest.mark.parametrize("is_ray", [False, True])
def test_the_first_hit_is_one_where_the_line_runs_along_a_face(is_ray: bool) -> None:
    """All hits of such a line were returned."""
    wall = engine.Surface([*CORNERS, [8, 0, -1], [8, 4, -1], [8, 2, 9]], [*QUADS, [8, 9, 10]])
    line = [[[-4, 2, 0], [16, 0, 0] if is_ray else [12, 2, 0]]]
    every, first = (engine.hits(line, wall, rays=is_ray, keep=keep) for keep in ("all", "first"))
    assert every.t.tolist() == [0.25, 0.75]
    assert (first.t.tolist(), first.t_end.tolist(), first.kind.tolist()) == ([0.25], [0.5], [HitKind.ALONG])


def test_segments_clipped_on_a_surface_are_sent_here() -> None:
    with pytest.raises(engine.UnsupportedSolidError, match="hits tells where segments meet a surface"):
        engine.clip_segments([[[1, 2, 1], [1, 2, 0]]], SHEET)
    with pytest.raises(engine.UnsupportedSolidError, match="give a polyhedron or surface"):
        engine.hits([[[1, 2, 1], [1, 2, 0]]], engine.Sphere([0, 0, 0], 1))


def test_threads_and_chunks_change_nothing() -> None:
    surface = engine.Surface(*MESHES["terrain"])
    lines = np.tile(lines_through(surface.vertices, surface.triangles, 9, 8), (400, 1, 1))
    once = engine.hits(lines, surface, workers=1)
    assert engine.hits(lines, surface, workers=2) == once
    assert len(once) == 400 * len(engine.hits(lines[:9], surface))


def test_a_segment_longer_than_the_largest_double_hits_bodies_of_scenes() -> None:
    surface = engine.Surface([[0, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2]])
    segment = [[[-1.7e308, -1, 0.25], [1.7e308, 1.5, 0.25]]]
    assert engine.hits(segment, surface).t.tolist() == [0.5]
    assert engine.Scene([surface]).hits(segment).t.tolist() == [0.5]
    assert engine.Scene([surface]).hits(segment, keep="any").tolist() == [True]


def exact_rows(lines: Any, images: list[Any], is_ray: bool) -> list[Any]:
    """Return (source, body, t) of the hits of lines on bodies of one triangle each, t as a fraction."""
    rows = []
    for source, (p, q) in enumerate(lines):
        way = vector(q) if is_ray else sub(vector(q), vector(p))
        found = [(hit.t, body) for body, image in enumerate(images)
                 for hit in reference.hits(vector(p), way, is_ray, image, [0])]  # fmt: skip
        rows += [(source, body, t) for t, body in sorted(found)]
    return rows


TRIANGLE = np.array([[0, -1, -1], [0, 1, -1], [0, 0, 2]])


@pytest.mark.parametrize("n", [3, 8])
@pytest.mark.parametrize(
    ("corners", "step", "ray"),
    [
        (1e-11 * TRIANGLE, [1e-10, 1e-10, 0], [[-1e-10, -5e-10, 0], [1e298, 5e298, 0]]),  # one is, times 2^33
        ([[1.7e308, 3e307, -1e300], [1.7e308, 5e307, -1e300], [1.7e308, 4e307, 1e300]], [-1e307, 0, 0],
         [[-1.7e308, -1e308, 0], [1e300, 4.1176470588235296e299, 0]]),  # the box is farther away than any double
    ],
)  # fmt: skip
def test_rays_beyond_doubles_in_the_coordinates_of_a_scene(n: int, corners: Any, step: Any, ray: Any) -> None:
    surfaces = [engine.Surface(np.add(corners, np.multiply(step, k)), [[0, 1, 2]]) for k in range(n)]
    expected = exact_rows([ray], [images_under(engine.Pose.identity(3), each)[0:1] for each in surfaces], True)
    found = engine.Scene(surfaces).hits([ray], rays=True)
    assert expected
    assert [*zip(found.body.tolist(), found.t.tolist())] == [(body, float(t)) for _, body, t in expected]


@pytest.mark.parametrize("n", [3, 8])
def test_rays_so_slow_that_they_stand_still_in_the_coordinates_of_a_scene(n: int) -> None:
    scene = engine.Scene([engine.Surface(1e300 * np.add(TRIANGLE, [k, 0, 0]), [[0, 1, 2]]) for k in range(n)])
    ray = [[[-1e300, 0, 0], [1e-30, 0, 0]]]
    assert scene.hits(ray, rays=True, keep="any").tolist() == [True]
    with pytest.raises(engine.NotRepresentableError):
        scene.hits(ray, rays=True)


def test_segments_beyond_doubles_in_the_frame_of_a_body() -> None:
    """It was an OverflowError."""
    beside = engine.Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [9e307, 0, 0])
    corners = np.array([[0, 1.1e308, 0], [1e300, 1.1e308, 0], [0, 1.1e308, 1e300], [0, 1.2e308, 0]])
    body, line = (
        engine.Polyhedron(corners, [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]]),
        [[-1e308, 2e299, 2e299], [1e308, 2e299, 2e299]],
    )
    images = images_under(beside, body)
    expected = [float(hit.t) for hit in reference.hits(
        vector(line[0]), sub(vector(line[1]), vector(line[0])), False, images, [0, 1, 2, 3])]  # fmt: skip
    scene = engine.Scene([body], [beside])
    assert len(expected) == 2
    assert scene.hits([line]).t.tolist() == expected
    assert scene.clip_segments([line]).t.tolist() == [expected]


class Counting(engine.Cancel):
    """Memory that a call announces."""

    taken = 0

    def take(self, n_bytes: int) -> None:
        self.taken += n_bytes


def test_memory_of_pairs_is_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("engine.scenes.hits._PAIRS", 1)
    lines, cancel = np.tile([[[1.0, 2, 9], [1, 2, 8]]], (100, 1, 1)), Counting()
    assert len(engine.Scene([SHEET, SHEET]).hits(lines, cancel=cancel)) == 0
    assert cancel.taken == 0
