"""Segments through scenes: every piece, every double and the order of all ends as in rational arithmetic."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from engine import (
    Aabb,
    CancelledError,
    Convex,
    Csg,
    DeadlineExceededError,
    HalfSpace,
    Implicit,
    InvalidOperationError,
    NotFiniteError,
    Polygon,
    Polyhedron,
    Pose,
    Scene,
    Solid,
    Sphere,
    Surface,
    Triangle,
    UnsupportedSolidError,
    WrongDimensionError,
    clip_segments,
)
from engine.running.budget import Cancel
from tests.reference.exact import nearest_double
from tests.reference.scene_segments import Piece, pieces_in_scene, ranks, rounded_point
from tests.unit.scenes.scenes import FACES, OCTAHEDRON, Random, pose_of, solids_of
from tests.unit.segment_clipping.scenes import as_json


def all_solids(dimension: int) -> list[Solid]:
    more: list[Solid] = [Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]], [[0, 1, 2], [0, 2, 3]])]
    return [*solids_of(dimension), *more * (dimension == 3)]


def scene_of(rng: Random, dimension: int, n: int, grid: float) -> tuple[list[Solid], list[Pose | None]]:
    solids = all_solids(dimension)
    chosen = [solids[k] for k in rng.integers(len(solids), size=n).tolist()]
    return chosen, [pose_of(rng, dimension, grid, 1.5) for _ in chosen]


def expected_pieces(segments: Any, solids: list[Solid], poses: list[Pose | None]) -> list[list[Piece]]:
    known = {id(solid): as_json(solid) for solid in solids}
    placed: list[Any] = [
        (known[id(solid)], pose and {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()})
        for solid, pose in zip(solids, poses)
    ]
    return [pieces_in_scene(segment, placed) for segment in segments.tolist()]


def assert_exact(found: Any, segments: Any, expected: list[list[Piece]]) -> None:
    flat = [(source, piece) for source, pieces in enumerate(expected) for piece in pieces]
    assert [*zip(found.source.tolist(), found.body.tolist())] == [(source, piece.body) for source, piece in flat]
    assert found.t.tolist() == [[nearest_double(piece.first), nearest_double(piece.last)] for _, piece in flat]
    for ends, name in ((found.start, "first"), (found.end, "last")):
        assert ends.tolist() == [rounded_point(segments[i].tolist(), getattr(piece, name)) for i, piece in flat]
    assert found.ranks.tolist() == [rank for pieces in expected for rank in ranks(pieces)]
    assert (found.faces[:, 0] < 0).tolist() == [piece.first == 0 for _, piece in flat]
    assert (found.faces[:, 1] < 0).tolist() == [piece.last == 1 for _, piece in flat]


def assert_first_and_any(scene: Scene, segments: Any, every: Any) -> None:
    first: Any = scene.clip_segments(segments, keep="first")
    rows = np.flatnonzero(np.append(True, every.source[1:] != every.source[:-1])[: len(every)])
    for name in ("source", "body", "start", "end", "t", "faces"):
        np.testing.assert_array_equal(getattr(first, name), getattr(every, name)[rows])
    meets: Any = scene.clip_segments(segments, keep="any")
    assert np.flatnonzero(meets).tolist() == sorted(set(every.source.tolist()))


@pytest.mark.parametrize("grid", [0.0, 0.5])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_is_what_rational_arithmetic_says(seed: int, dimension: int, grid: float) -> None:
    rng = np.random.default_rng([seed, dimension, int(2 * grid)])
    solids, poses = scene_of(rng, dimension, 6, grid)
    segments = rng.uniform(-2.5, 2.5, (8, 2, dimension))
    if grid:
        segments = np.round(segments / grid) * grid  # along faces, through vertices, of no length
    scene = Scene(solids, poses)
    found = scene.clip_segments(segments)
    assert_exact(found, segments, expected_pieces(segments, solids, poses))
    assert_first_and_any(scene, segments, found)
    step = pose_of(rng, dimension, grid)
    after = scene.moved({2: step})
    placed = [step if body == 2 else pose for body, pose in enumerate(poses)]
    moved = after.clip_segments(segments)
    assert_exact(moved, segments, expected_pieces(segments, solids, placed))
    assert_first_and_any(after, segments, moved)


def test_is_what_clip_segments_says_of_one_body() -> None:
    rng = np.random.default_rng(3)
    for dimension in (2, 3):
        segments = np.round(rng.uniform(-2, 2, (200, 2, dimension)) * 4) / 4
        for solid in solids_of(dimension):
            if solid.type in ("triangle", "csg"):
                continue
            alone: Any = clip_segments(segments, solid)
            for pose in (None, Pose.identity(dimension)):
                found: Any = Scene([solid], [pose]).clip_segments(segments)
                for name in ("source", "start", "end", "t", "faces"):
                    np.testing.assert_array_equal(getattr(found, name), getattr(alone, name), solid.type)


@pytest.mark.parametrize("scale", [1.0, 2.0**-1070, 2.0**900])
def test_posed_vertices_that_are_doubles_need_no_rationals(scale: float) -> None:
    rng, turn = np.random.default_rng(11), [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    body = Polyhedron(np.multiply(OCTAHEDRON, scale), FACES)
    segments = rng.integers(-2, 3, (150, 2, 3)) * scale  # along edges, in faces, through vertices
    for pose in (Pose(np.eye(3), [scale, 0, -scale]), Pose(turn, [-scale, scale, 0])):
        found, report = Scene([body], [pose]).clip_segments(segments, report=True)
        assert_exact(found, segments, expected_pieces(segments, [body], [pose]))
        moved = Polyhedron(body.vertices @ pose.rotation.T + pose.translation, FACES)
        np.testing.assert_array_equal(found.faces, clip_segments(segments, moved).faces)
        assert report.n_rational == 0 or scale != 1.0
    far = Pose(np.eye(3), [2.0**60 * scale, 0, scale / 3])  # vertices that are no doubles there
    near = segments + np.array([0, 0, scale / 3])
    assert_exact(Scene([body], [far]).clip_segments(near), near, expected_pieces(near, [body], [far]))


def test_ends_that_round_alike_are_put_in_exact_order() -> None:
    """The faces of three boxes stand at 1/3, just before it and just behind: in doubles along the segment all alike."""
    third = 1 / 3  # below 1/3 exactly
    boxes: list[Solid] = [Aabb([3.0, -1], [4, 1]), HalfSpace([3, 0], -9.0), Sphere([6, 0], 3)]
    segment = [[[0, 0], [9, 0]]]
    found = Scene(boxes).clip_segments(segment)
    assert found.ranks.tolist() == [[0, 1], [0, 2], [0, 2]]
    assert found.t[:, 0].tolist() == [third] * 3
    tilted: list[Solid] = [
        HalfSpace([1, 0], -3.0),
        HalfSpace([1.0, 2.0**-60], -3.0),
        HalfSpace([1.0, -(2.0**-60)], -3.0),
    ]
    found = Scene(tilted).clip_segments([[[0, 1], [9, 1]]])
    assert found.body.tolist() == [1, 0, 2]
    assert found.ranks[:, 0].tolist() == [0, 1, 2]
    assert found.t[:, 0].tolist() == [third] * 3
    turned = Pose([[0.6, -0.8], [0.8, 0.6]], [0.3, -0.1])
    found = Scene([Sphere([0, 0], 1), Sphere([0, 0], 1)], [turned, turned]).clip_segments([[[-3, 0], [3, 0.1]]])
    assert found.body.tolist() == [0, 1]
    assert found.ranks.tolist() == [[0, 1], [0, 1]]


def adversarial(rng: Random, k: int, n: int) -> tuple[Scene, Any]:
    """Return a scene of all types, and segments of a lattice, an ulp off it, along axes, or hardly longer than none."""
    dimension, grid = 2 + k % 2, (0.5, 0.25, 0.0, 0.5, 0.125)[k % 5]
    scene = Scene(*scene_of(rng, dimension, int(rng.choice([1, 2, 3, 6, 12])), grid))
    segments = rng.uniform(-2.5, 2.5, (n, 2, dimension))
    segments = np.round(segments / grid) * grid if grid else segments
    if k % 4 == 1:
        segments = np.nextafter(segments, rng.choice([-np.inf, np.inf], segments.shape))
    if k % 4 == 2:
        segments[:, 1, 1:] = segments[:, 0, 1:]
    if k % 4 == 3:
        segments[::2, 1] = np.nextafter(segments[::2, 0], segments[::2, 1])
    return scene, segments


@pytest.mark.parametrize("n", [4, pytest.param(3200, marks=pytest.mark.full)])
def test_adversarial_segments_are_cut_as_rationals_say(n: int, seed: str) -> None:
    for k in range(n):
        rng = np.random.default_rng([k, *seed.encode()])
        scene, segments = adversarial(rng, k, 32)
        found = scene.clip_segments(segments)
        assert_exact(found, segments, expected_pieces(segments, list(scene.solids), list(scene.poses)))
        assert_first_and_any(scene, segments, found)


def assert_partition(found: Any, segments: Any) -> None:
    """The ends along each segment are ranked without a gap, parameters go up with ranks, pieces of a body are apart."""
    assert ((found.t >= 0) & (found.t <= 1)).all()
    assert (found.ranks[:, 0] <= found.ranks[:, 1]).all()
    sources, ranks, t = np.repeat(found.source, 2), found.ranks.ravel(), found.t.ravel()
    order = np.lexsort((ranks, sources))
    goes_on = np.diff(sources[order]) == 0
    steps, rises = np.diff(ranks[order])[goes_on], np.diff(t[order])[goes_on]
    assert not ranks[order][np.append(True, ~goes_on)[: len(ranks)]].any()
    assert ((steps == 0) | (steps == 1)).all()
    assert ((rises == 0) | ((rises > 0) & (steps == 1))).all()
    assert (np.lexsort((found.body, found.ranks[:, 0], found.source)) == np.arange(len(found))).all()
    order = np.lexsort((found.ranks[:, 0], found.body, found.source))
    is_next = (np.diff(found.source[order]) == 0) & (np.diff(found.body[order]) == 0)
    assert (found.ranks[order, 0][1:] > found.ranks[order, 1][:-1])[is_next].all()
    for end, ends in enumerate((found.start, found.end)):
        is_own = found.faces[:, end] < 0
        assert (found.t[is_own, end] == end).all()
        assert (ends[is_own] == segments[found.source[is_own], end]).all()


@pytest.mark.parametrize("n", [4, pytest.param(200, marks=pytest.mark.full)])
def test_pieces_and_gaps_make_up_the_segment(n: int, seed: str) -> None:
    for k in range(n):
        rng = np.random.default_rng([k, *seed.encode()])
        scene, segments = adversarial(rng, k, 40 if n == 4 else 5000)
        assert_partition(scene.clip_segments(segments), segments)


def test_a_surface_is_crossed_in_points() -> None:
    sheet = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    lid = Pose(np.eye(3), [0, 0, 0.5])
    scene = Scene([sheet, sheet], [None, lid])
    found = scene.clip_segments([[[0.25, 0.25, -1], [0.25, 0.25, 3]], [[-1, 0.5, 0], [3, 0.5, 0]]])
    assert found.source.tolist() == [0, 0, 1]
    assert found.body.tolist() == [0, 1, 0]
    assert found.t.tolist() == [[0.25, 0.25], [0.375, 0.375], [0.25, 0.5]]
    assert found.faces.tolist() == [[0, 0]] * 3
    points = scene.clip_segments([[[0.5, 0, 0]] * 2, [[0.25, 0.25, 0]] * 2, [[0.25, 0.25, 0.1]] * 2])
    assert (points.source.tolist(), points.body.tolist(), points.t.tolist()) == ([0, 1], [0, 0], [[0, 1]] * 2)


def test_faces_of_a_csg_are_counted_through_its_leaves() -> None:
    box, ball = Aabb([0, 0], [4, 4]), Sphere([2, 2], 1)
    ring = Csg("difference", [box, ball])
    found = Scene([ring]).clip_segments([[[-1, 2], [5, 2]]])
    assert found.faces.tolist() == [[0, 4], [4, 1]]
    assert found.start.tolist() == [[0, 2], [3, 2]]
    joined = Csg("union", [Aabb([0, 0], [1, 1]), Aabb([1, 0], [2, 1])])
    found = Scene([joined]).clip_segments([[[-1, 0.5], [3, 0.5]]])
    assert found.t.tolist() == [[0.25, 0.75]]
    assert found.faces.tolist() == [[0, 5]]


def test_touching_is_a_point_and_no_length_is_a_point() -> None:
    ball, cube = Sphere([0, 0, 0], 1), Aabb([-1, -1, -1], [1, 1, 1])
    prism = Triangle([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    scene = Scene([ball, cube, prism], [None, None, Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [0, 0, 0])])
    found = scene.clip_segments([[[-1, 1, 0], [1, 1, 0]], [[0, 0, 1], [0, 0, 1]], [[0, 0, 9], [0, 0, 9]]])
    assert found.source.tolist() == [0, 0, 0, 1, 1, 1, 2]
    assert found.body.tolist() == [1, 0, 2, 0, 1, 2, 2]
    assert found.t.tolist() == [[0, 1], [0.5, 0.5], [0.5, 0.5], [0, 1], [0, 1], [0, 1], [0, 1]]


def test_nothing_is_welcome() -> None:
    scene = Scene([Sphere([0, 0], 1)])
    assert len(scene.clip_segments([])) == 0
    assert len(Scene([]).clip_segments([[[0, 0], [1, 1]]])) == 0
    assert Scene([]).clip_segments([[[0, 0], [1, 1]]], keep="any").tolist() == [False]
    assert scene.clip_segments([], keep="any").shape == (0,)
    assert len(scene.clip_segments([[[5, 5], [6, 6]]], keep="first")) == 0
    empty = Convex([[1, 0, -1], [-1, 0, -1]])
    assert len(Scene([empty]).clip_segments([[[-5, 0], [5, 0]]])) == 0


def test_says_what_is_wrong() -> None:
    segments = [[[-2, 0], [2, 0]]]
    waves = Implicit([{"powers": [2, 0], "coefficient": 1.0}])
    with pytest.raises(UnsupportedSolidError, match=r"solids\[1\]: no segment is cut on an implicit; give a"):
        Scene([Sphere([0, 0], 1), waves]).clip_segments(segments)
    with pytest.raises(UnsupportedSolidError, match=r"solids\[0\]: no segment is cut on an implicit"):
        Scene([Csg("union", [waves, waves])]).clip_segments(segments, keep="any")
    scene = Scene([Sphere([0, 0], 1)])
    with pytest.raises(InvalidOperationError, match="keep must be all, first or any, got 'last'"):
        scene.clip_segments(segments, keep="last")  # type: ignore[call-overload]
    with pytest.raises(WrongDimensionError):
        scene.clip_segments([[[0, 0, 0], [1, 1, 1]]])
    with pytest.raises(NotFiniteError):
        scene.clip_segments([[[0, 0], [1, np.inf]]])
    with pytest.raises(DeadlineExceededError):
        scene.clip_segments(segments, deadline=-1.0)
    switch = Cancel()
    switch.set()
    with pytest.raises(CancelledError):
        scene.clip_segments(segments, cancel=switch)


def test_reports_and_counts_segments() -> None:
    seen: list[int] = []
    scene = Scene([Polygon([[[0, 0], [1, 0], [0, 1]]]), Triangle([[0, 0], [1, 0], [0, 1]])])
    pieces, accuracy = scene.clip_segments([[[0, 0.25], [1, 0.25]]] * 3, report=True, progress=seen.append, workers=2)
    assert (accuracy.decisions, accuracy.coordinates_ulp, accuracy.n_items, sum(seen)) == ("exact", 0.5, 3, 3)
    assert len(pieces) == 6
    assert (accuracy.n_beyond_filter, accuracy.n_rational) == (3, 0)


def test_counts_what_the_kernels_leave() -> None:
    scene = Scene([Aabb([0.5, 0.5], [1, 1]), Sphere([3, 0], 1)], [None, Pose([[0, -1], [1, 0]], [1, 0])])
    segments = [[[-1, 0.75], [2, 0.7]], [[-1, 1], [2, 1]], [[0, 4], [2, 4]], [[5, 5], [6, 6]]]
    _, accuracy = scene.clip_segments(segments, report=True)
    assert (accuracy.n_beyond_filter, accuracy.n_rational) == (2, 1)  # along a wall, and the tangent


def test_mesh_pieces_are_the_same_one_by_one_and_many_at_a_time() -> None:
    rng = np.random.default_rng(5)
    body = Polyhedron(OCTAHEDRON, FACES)
    segments = np.concatenate([rng.uniform(-2, 2, (150, 2, 3)), rng.integers(-2, 3, (50, 2, 3)) * 0.5])
    scene = Scene([body, body, Aabb([0, 0, 0], [1, 1, 1])], [None, Pose(np.eye(3), [0.25, 0, 0]), None])
    every = scene.clip_segments(segments)
    alone = [scene.clip_segments(segment[None]) for segment in segments]
    for name in ("body", "start", "end", "t", "faces", "ranks"):
        np.testing.assert_array_equal(getattr(every, name), np.concatenate([getattr(each, name) for each in alone]))
    assert_first_and_any(scene, segments, every)
    moved = scene.moved({0: Pose(np.eye(3), [0.5, 0, 0]), 2: Pose(np.eye(3), [-1, 0, 0])})
    assert_first_and_any(moved, segments, moved.clip_segments(segments))


@pytest.mark.full
def test_a_mesh_of_many_faces_posed_and_not() -> None:
    turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, 5, endpoint=False), np.linspace(-1, 1, 4), indexing="ij")
    radius = np.sqrt(1.25 - rise**2)
    belts = np.stack([radius * np.cos(turn), radius * np.sin(turn), rise], axis=2).reshape(-1, 3)
    quads = [(4 * i + j, 4 * ((i + 1) % 5) + j) for i in range(5) for j in range(3)]
    sides = [face for a, b in quads for face in ([a, b, b + 1], [a, b + 1, a + 1])]
    body = Polyhedron(belts, [*sides, [16, 12, 8, 4, 0], [3, 7, 11, 15, 19]])
    rng = np.random.default_rng(0)
    pose = pose_of(np.random.default_rng(8), 3)
    segments = rng.uniform(-2, 2, (6, 2, 3))
    segments[:2, 0] = belts[:2]
    expected = expected_pieces(segments, [body, body], [None, pose])
    assert_exact(Scene([body, body], [None, pose]).clip_segments(segments), segments, expected)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_few_segments_in_an_array_are_answered_as_lists_are(dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    scene = Scene(*scene_of(rng, dimension, 8, 0.5))
    segments = np.round(rng.uniform(-3, 3, (12, 2, dimension)) * 2) / 2
    moved: Any
    for moved in (scene, scene.moved({1: None})):
        moved.clip_segments(segments.tolist())  # prepares
        every = moved.clip_segments(segments.tolist())
        few = moved.clip_segments(segments)
        first = moved.clip_segments(segments, keep="first", workers=1)
        rows = np.unique(every.source, return_index=True)[1]
        for name in ("source", "body", "start", "end", "t", "faces"):
            assert getattr(few, name).tolist() == getattr(every, name).tolist()
            assert getattr(first, name).tolist() == getattr(every, name)[rows].tolist()
        met = moved.clip_segments(segments, keep="any")
        assert np.flatnonzero(met).tolist() == every.source[rows].tolist()
        segments_with_nan = segments.copy()
        segments_with_nan[3, 0, 0] = np.nan
        for keep in ("all", "first", "any"):
            with pytest.raises(NotFiniteError):
                moved.clip_segments(segments_with_nan, keep=keep)
            with pytest.raises(InvalidOperationError):
                moved.clip_segments(segments, keep=keep.upper())


def test_a_segment_that_leaves_the_box_begins_where_crossings_say() -> None:
    """Inside of a mesh by parity: through faces, corners and sides, with its second end outside of the box."""
    rng, shift = np.random.default_rng(3), np.array([3.0, 5.0, 9.0])
    corners = np.array(OCTAHEDRON, np.float64) + shift
    body = Polyhedron(corners, FACES)
    start = shift + rng.integers(-3, 4, (60, 3)) / 8
    through = np.concatenate([corners, corners[np.array(FACES)[:, :2]].mean(axis=1)])
    end = start + 8.0 * (through[rng.integers(len(through), size=60)] - start)
    for pose in (None, pose_of(rng, 3), pose_of(rng, 3)):
        segments = np.stack([start, end], axis=1)
        assert_exact(Scene([body], [pose]).clip_segments(segments), segments, expected_pieces(segments, [body], [pose]))


def test_edges_touched_midway_between_doubles_are_left_to_nobody() -> None:
    """A segment meets the middle of an edge at t = 1/2, whose coordinates end in half a unit: the even neighbour."""
    rng, unit = np.random.default_rng(11), 2.0**-52
    solid = Polyhedron(1.5 + 0.25 * np.array(OCTAHEDRON) + rng.integers(-9, 10, (6, 3)) * unit, FACES)
    sides = solid.vertices[np.array(FACES)[:, :2]]
    ends = sides[rng.integers(len(sides), size=60)]
    starts = 1.5 + np.round(rng.uniform(-0.2, 0.2, (60, 3)) / unit) * unit
    segments = np.stack([starts, ends[:, 0] + (ends[:, 1] - starts)], axis=1)  # all between 1 and 2: no rounding
    sums = (segments / unit).astype(np.int64).sum(axis=1)
    assert (sums == (ends / unit).astype(np.int64).sum(axis=1)).all()
    assert (sums % 2).any(axis=1).sum() > 40
    found, report = Scene([solid]).clip_segments(segments, report=True)
    assert_exact(found, segments, expected_pieces(segments, [solid], [None]))
    assert report.n_beyond_filter == 0
    assert (found.t == 0.5).any(axis=1).sum() > 40


def test_many_at_once_are_what_the_general_way_finds() -> None:
    rng = np.random.default_rng(12)
    solids, poses = scene_of(rng, 3, 12, 0.5)
    scene, segments = Scene(solids, poses), rng.integers(-6, 7, (1024, 2, 3)) / 4.0
    for keep in ("all", "first", "any"):
        general: Any = scene.clip_segments(segments, keep=keep, deadline=600.0)  # a deadline is watched in parts
        for n in (1, 63, 1024):
            found: Any = scene.clip_segments(segments[:n], keep=keep)
            if keep == "any":
                assert found.tolist() == general[:n].tolist()
                continue
            m = int((general.source < n).sum())
            for name in ("source", "body", "start", "end", "t", "faces", "ranks"):
                np.testing.assert_array_equal(getattr(found, name), getattr(general, name)[:m])


def test_numbers_whose_sum_is_none_are_no_error_and_no_warning() -> None:
    segments = np.full((4, 2, 3), 1.5e308) * [[[1.0], [-1.0]]]
    segments[2:, :, 0] = 1.25e308
    scene = Scene([Polyhedron(OCTAHEDRON, FACES), Sphere([0, 0, 0], 1)])
    every, infinite = scene.clip_segments(segments), np.where(np.arange(4)[:, None, None] < 2, segments, np.inf)
    infinite[3, 1, 1] = -np.inf
    with np.errstate(all="raise"):
        for keep in ("all", "first", "any"):
            found: Any = scene.clip_segments(segments, keep=keep)
            assert (found.tolist() == [True, True, False, False]) if keep == "any" else len(found)
            with pytest.raises(NotFiniteError, match=r"segments\[2\]\[0\]\[0\]"):
                scene.clip_segments(infinite, keep=keep)
        assert_first_and_any(scene, segments, every)


@pytest.mark.parametrize("keep", ["all", "first", "any"])
def test_ends_soon_where_many_trees_of_solids_are_placed(keep: Any) -> None:
    tree = Csg("difference", [Aabb([-1, -1, -1], [1, 1, 1]), Sphere([0, 0, 0], 0.5)])
    pose = Pose([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [0.5, 0, 0])
    scene, start = Scene([tree] * 10_000, [pose] * 10_000), time.process_time()
    with pytest.raises(DeadlineExceededError):
        scene.clip_segments(np.ones((60, 2, 3)) * [[[-2.0], [2.0]]], keep=keep, deadline=0.02)
    assert time.process_time() - start < 0.5


@pytest.mark.parametrize("y", [0.25, 0.5])
def test_a_piece_whose_ends_have_the_same_double_is_longer_than_a_point(y: float) -> None:
    """The second end is no contact: it lies within the square, 2^-60 behind its side."""
    square, segments = Polygon([[[0, 0], [1, 0], [1, 1], [0, 1]]]), np.array([[[-1.0, y], [2.0**-60, y]]])
    for keep in ("all", "first"):
        found: Any = Scene([square]).clip_segments(segments, keep=keep)
        assert (found.t.tolist(), found.start.tolist(), found.end.tolist()) == ([[1, 1]], [[0, y]], [[2.0**-60, y]])
        assert found.ranks.tolist() == [[0, 1]]
