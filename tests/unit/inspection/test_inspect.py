"""What is wrong with a mesh: planted faults are found with their places, crossings as in rational arithmetic; mends."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import engine
from engine.files.meshes import read_mesh

CORNERS = [(float(x), float(y), float(z)) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
CUBE = [(a, b, c) for a, b, c, d in QUADS] + [(a, c, d) for a, b, c, d in QUADS]


def at(*cubes: tuple[float, float]) -> tuple[np.ndarray, list[Any]]:
    """Return cubes of some sizes about some middles on a diagonal."""
    corners = [(np.array(CORNERS) - 0.5) * size + middle for middle, size in cubes]
    return np.concatenate(corners), [tuple(8 * k + i for i in face) for k in range(len(cubes)) for face in CUBE]


def test_a_sound_mesh_has_nothing() -> None:
    for mesh in ((CORNERS, CUBE), (CORNERS, QUADS), engine.Polyhedron(CORNERS, CUBE)):
        found = engine.inspect(mesh)
        assert repr(found) == "<Inspection: 12 faces, nothing is wrong>"
        assert (found.is_closed, found.advice, found.n_shells, found.mended) == (True, {}, 1, ())
        assert engine.locate([(0.5, 0.5, 0.5)], found.solid()).tolist() == [1]


def test_open_edges_and_turned_edges_have_their_ends() -> None:
    found = engine.inspect((CORNERS, CUBE[1:]))
    assert found.open_edges.tolist() == [[0, 2], [0, 3], [2, 3]]
    assert not found.is_closed
    assert list(found.advice) == ["open_edges"]
    turned = engine.inspect((CORNERS, [CUBE[0][::-1], *CUBE[1:]]))
    assert turned.turned_edges.tolist() == [[0, 2], [0, 3], [2, 3]]
    assert not len(turned.open_edges)


def test_duplicates_flat_faces_and_equal_vertices() -> None:
    corners = [*CORNERS, (0.5, 0.0, 0.0), (0.0, 0.0, 0.0)]
    found = engine.inspect((corners, [*CUBE, CUBE[3], (0, 8, 1), (0, 0, 1), (9, 2, 1)]))
    assert found.duplicate_faces.tolist() == [[12, 3]]
    assert found.flat_faces.tolist() == [13, 14]
    assert found.faces[15].tolist() == [0, 2, 1]  # the vertex at equal coordinates


def test_t_junctions_are_exact_and_filled() -> None:
    corners, faces = np.array([*CORNERS, (0.5, 0.0, 0.0), (0.25, 0.0, 0.0)]), [f for f in CUBE if not {0, 1} <= set(f)]
    split = [(0, 9, 5), (9, 8, 5), (8, 1, 5)]  # of the face y = 0 alone
    (below,) = [face for face in CUBE if {0, 1} <= set(face) and 5 not in face]
    mesh = corners, [*faces, *split, below]
    found = engine.inspect(mesh)
    assert found.t_junctions.tolist() == [[0, 1, 9], [0, 1, 8]]
    assert not len(found.self_crossings)
    filled = engine.inspect(mesh, fill_t_junctions=True)
    assert filled.is_closed
    assert filled.mended == ("fill_t_junctions: 1 sides of faces are split at the vertices on them",)
    assert len(filled.faces) == 16
    assert engine.locate([(0.5, 0.5, 0.5), (0.3, 0, 0)], filled.solid()).tolist() == [1, 0]
    off = corners.copy()
    off[8, 1] = 5e-324  # beside the edge by the smallest number
    assert engine.inspect((off, mesh[1])).t_junctions.tolist() == [[0, 1, 9]]


def test_inverted_shells_by_nesting() -> None:
    points, faces = at((0, 9), (0, 5), (0, 2), (20, 2))
    turned = [face[::-1] for face in faces]
    good = faces[:12] + turned[12:24] + faces[24:]
    assert not engine.inspect((points, good)).inverted_shells
    assert engine.inspect((points, good)).n_shells == 4
    found = engine.inspect((points, faces[:12] + faces[12:24] + faces[24:36] + turned[36:]))
    assert [sorted(shell.tolist()) for shell in found.inverted_shells] == [list(range(12, 24)), list(range(36, 48))]
    mended = engine.inspect((points, turned), orient=True)
    assert not mended.inverted_shells
    assert mended.solid() == engine.Polyhedron(points, mended.faces)
    assert engine.inspect((points, mended.faces)).mended == ()


def test_faces_that_run_the_wrong_way_are_turned() -> None:
    draw = np.random.default_rng(3)
    mixed = [face[::-1] if draw.random() < 0.5 else face for face in CUBE]
    found = engine.inspect((CORNERS, mixed), orient=True)
    assert found.is_closed
    assert not found.inverted_shells
    strip = [(0, 1, 2), (1, 3, 2), (2, 3, 4), (3, 5, 4), (4, 5, 1), (5, 0, 1)]  # of Moebius
    points = [(np.cos(k), np.sin(k), k % 2) for k in range(6)]
    assert "one-sided" in engine.inspect((points, strip), orient=True).mended[0]


def test_weld_closes_gaps_and_says_how_far() -> None:
    soup = np.array(CORNERS)[np.array(CUBE).ravel()]
    soup += np.random.default_rng(0).uniform(-1e-7, 1e-7, soup.shape)
    faces = np.arange(36).reshape(-1, 3)
    assert len(engine.inspect((soup, faces)).open_edges) == 36
    found = engine.inspect((soup, faces), weld=1e-6)
    assert found.is_closed
    assert found.mended[0].startswith("weld: 28 vertices are made one with another, moved by ")
    assert "0 faces collapsed" in found.mended[0]


def crossing(points: Any, t: Any, u: Any) -> bool:
    """Return whether two triangles have a common point besides common corners and edges, in rational arithmetic."""
    common = sorted(set(t) & set(u))
    ts, us = ([tuple(map(Fraction, points[k])) for k in each] for each in (t, u))
    hull = [tuple(map(Fraction, points[k])) for k in common]
    return any(not is_on(p, hull) for p in candidates(ts, us) if in_triangle(p, ts) and in_triangle(p, us))


def minus(p: Any, q: Any) -> Any:
    return tuple(x - y for x, y in zip(p, q, strict=True))


def cross(p: Any, q: Any) -> Any:
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def dot(p: Any, q: Any) -> Any:
    return sum(x * y for x, y in zip(p, q, strict=True))


def is_on(p: Any, hull: Any) -> bool:
    if len(hull) < 2:
        return p in hull
    a, b = hull
    along = minus(b, a)
    return cross(minus(p, a), along) == (0, 0, 0) and 0 <= dot(minus(p, a), along) <= dot(along, along)


def in_triangle(p: Any, t: Any) -> bool:
    normal = cross(minus(t[1], t[0]), minus(t[2], t[0]))
    sides = [dot(normal, cross(minus(t[(k + 1) % 3], t[k]), minus(p, t[k]))) for k in range(3)]
    return dot(normal, minus(p, t[0])) == 0 and min(sides) >= 0


def candidates(ts: Any, us: Any) -> Any:
    """Return points among which are all corners of the intersection of two triangles."""
    found = [*ts, *us]
    for one, other in ((ts, us), (us, ts)):
        normal = cross(minus(other[1], other[0]), minus(other[2], other[0]))
        for k in range(3):
            p, q = one[k], one[(k + 1) % 3]
            d, e = dot(normal, minus(p, other[0])), dot(normal, minus(q, other[0]))
            if d != e:
                found.append(tuple(x + (y - x) * d / (d - e) for x, y in zip(p, q, strict=True)))
            for j in range(3):  # of two in one plane the edges cross
                r, s = other[j], other[(j + 1) % 3]
                along = cross(minus(q, p), minus(s, r))
                if any(along):
                    t = dot(cross(minus(r, p), minus(s, r)), along) / dot(along, along)
                    found.append(tuple(x + (y - x) * t for x, y in zip(p, q, strict=True)))
    return found


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", range(12))
def test_crossings_are_those_of_rational_arithmetic(seed: int) -> None:
    draw = np.random.default_rng(seed)
    points = np.unique(draw.integers(0, 3 + seed % 3, (9, 3)), axis=0) * [1.0, 1e-3, 1e6][seed % 3]
    faces = list(combinations(range(len(points)), 3))
    faces = [faces[k] for k in draw.choice(len(faces), min(len(faces), 24), replace=False)]
    found = engine.inspect((points, faces))
    sets = [set(face) for face in faces]
    at_junctions = {
        (i, j) for low, high, vertex in found.t_junctions.tolist()
        for i, f in enumerate(sets) for j, g in enumerate(sets)
        if ({low, high} <= f and vertex in g) or ({low, high} <= g and vertex in f)
    }  # fmt: skip
    flat = set(found.flat_faces.tolist())
    expected = [
        [i, j] for i, j in combinations(range(len(faces)), 2)
        if not {i, j} & flat and (i, j) not in at_junctions and crossing(points, faces[i], faces[j])
    ]  # fmt: skip
    assert found.self_crossings.tolist() == expected
    exact = [[tuple(map(Fraction, points[k])) for k in face] for face in faces]
    assert flat == {k for k, (p, q, r) in enumerate(exact) if not any(cross(minus(q, p), minus(r, p)))}


def test_files_and_what_is_no_mesh(tmp_path: Path) -> None:
    text = "OFF\n8 11 0\n" + "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS)
    text += "".join(f"3 {a} {b} {c}\n" for a, b, c in CUBE[1:])
    (tmp_path / "open.off").write_text(text)
    for given in (tmp_path / "open.off", str(tmp_path / "open.off"), text.encode()):
        assert len(engine.inspect(given).open_edges) == 3
    for bad in (None, 7, engine.Sphere((0, 0), 1), [CORNERS], {"type": "Polygon"}):
        with pytest.raises(engine.EngineError):
            engine.inspect(bad)  # type: ignore[arg-type]
    with pytest.raises(engine.IndexOutOfRangeError):
        engine.inspect((CORNERS, [(0, 1, 8)]))
    with pytest.raises(engine.InvalidInputError, match="weld must be a distance"):
        engine.inspect((CORNERS, CUBE), weld=-1.0)
    with pytest.raises(engine.InvalidInputError, match="orient must be True or False"):
        engine.inspect((CORNERS, CUBE), orient="yes")  # type: ignore[arg-type]
    with pytest.raises(engine.DeadlineExceededError):
        engine.inspect((CORNERS, CUBE), deadline=0.0)


def test_a_mesh_is_closed_only_if_a_polyhedron_is_made_of_it() -> None:
    for faces in ([*CUBE, (0, 0, 1)], [(0, 0, 1)]):
        report = engine.inspect((CORNERS, faces))
        assert not report.is_closed
        assert "weld=0.0" in report.advice["flat_faces"]
    assert engine.inspect((CORNERS, [*CUBE, (0, 0, 1)]), weld=0.0).is_closed
    gone = engine.inspect((CORNERS, CUBE), weld=9.0)
    assert (len(gone.faces), gone.is_closed) == (0, False)


def test_faces_without_area_are_left_out_where_filling_leaves_nothing_of_them() -> None:
    corners = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, 1.0, 1.0)]
    for flat in ((0, 0, 1), (0, 1, 2)):
        faces = [(0, 1, 3), flat, *([(1, 0, 4)] if flat[1] else []), (2, 4, 3)]
        report = engine.inspect((corners, faces), fill_t_junctions=True)
        assert report.faces.tolist()[:2] == [[0, 2, 3], [2, 1, 3]]
        assert "1 faces without area" in report.mended[0]
        assert not any(len(set(face)) < 3 for face in report.faces.tolist())


def test_vertices_on_an_edge_are_in_order_however_near_they_are() -> None:
    """Beside 1 the two places differ by less than a rounding."""
    corners = [(1.0, 0, 0), (-1.0, 0, 0), (0, 1, 0), (2e-17, 0, 0), (1e-17, 0, 0), (0, -1, 0), (0, -1, 1), (1, -1, 1)]
    faces = [(0, 1, 2), (3, 5, 6), (4, 6, 7)]
    report = engine.inspect((corners, faces))
    assert report.t_junctions.tolist() == [[0, 1, 3], [0, 1, 4]]
    assert engine.inspect((corners, faces), fill_t_junctions=True).faces.tolist()[:3] == [
        [0, 3, 2],
        [3, 4, 2],
        [4, 1, 2],
    ]


def test_a_shell_whose_corners_are_all_on_another_lies_within_it() -> None:
    inner = [(0.5, 0.5, 0.0), (0.5, 0.5, 1.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5)]
    outward = [(a + 8, b + 8, c + 8) for a, b, c in [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]]
    (volume,) = {np.sign(np.linalg.det([np.subtract(inner[k], inner[0]) for k in (1, 2, 3)]))}
    inward = outward if volume > 0 else [face[::-1] for face in outward]
    both = [[*CUBE, *each] for each in (inward, [face[::-1] for face in inward])]
    found = [[shell.tolist() for shell in engine.inspect(([*CORNERS, *inner], each)).inverted_shells] for each in both]
    assert sorted(map(len, found)) == [0, 1]
    cavity = engine.inspect(([*CORNERS, *inner], both[found.index([])]))
    assert engine.locate([(0.4, 0.4, 0.5)], cavity.solid()).tolist() == [-1]
    tetrahedron = cavity.faces[12:] - 8
    assert engine.inspect((inner, tetrahedron)).inverted_shells  # by itself it is inside out


def test_weld_takes_pairs_at_the_distance_itself_and_many_at_once() -> None:
    draw = np.random.default_rng(5)
    for _ in range(20):
        a, distance = draw.random(3) * draw.choice([1.0, 1e3]), float(draw.random())
        b = a + np.array([distance, 0, 0])
        exact = float(np.sqrt(np.square(a - b).sum()))
        report = engine.inspect(([a, b, (9e9, 0, 0), (0, 9e9, 0)], [(0, 2, 3), (1, 2, 3)]), weld=exact)
        assert report.faces.tolist() == [[0, 2, 3], [0, 2, 3]], (a, b)
    spots = draw.random((400, 3))
    faces = np.arange(399 // 3 * 3).reshape(-1, 3)
    report = engine.inspect((spots, faces), weld=1e308)
    assert len(report.faces) == 0
    assert report.mended[0].startswith("weld: 398 vertices are made one with another")


def test_files_and_mends_end_when_they_are_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Readers of files, and every loop over faces, ask whether to go on."""
    n = 3000
    spots = "".join(f"{k} {k * k % 7} {k % 5}\n" for k in range(n))
    rows = "".join(f"3 {k} {k + 1} {k + 2}\n" for k in range(n - 2))
    files = [
        f"OFF\n{n} {n - 2} 0\n{spots}{rows}",
        "".join(f"v {row}\n" for row in spots.splitlines()) + "f 1 2 3\n" * n,
        "solid\n" + "facet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\n" * n,
        f"ply\nformat ascii 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {n - 2}\nproperty list uchar int vertex_indices\nend_header\n{spots}{rows}",
    ]
    for text in files:
        cancel = engine.Cancel()
        monkeypatch.setattr(
            "engine.inspection.inspect.read_mesh", lambda file, own=cancel: (own.set(), read_mesh(file))
        )
        with pytest.raises(engine.CancelledError):
            engine.inspect(text.encode(), cancel=cancel)
