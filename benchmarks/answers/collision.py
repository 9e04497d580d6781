"""Questions to collide, collide_poses, collide_scene and collide_triangles; witnesses are hashed apart."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks.answers import shapes, solids
from benchmarks.answers.asking import Drawn, Question, drawn_by, family, same
from benchmarks.answers.draws import FAR_PLACES, HOME, NEAR_PLACES, Array, Draw, turned

Pair = tuple[Any, Any]


def said(witness: engine.Witness | None) -> Any:
    """Return a witness as a list."""
    if witness is None:
        return None
    return [witness.kind, witness.first_face, witness.second_face, witness.containing, witness.piercing]


def _has_inside(*pair: Any) -> bool:
    return not any(isinstance(solid, engine.Surface) for solid in pair)


def collided(first: Any, second: Any, poses: tuple[Any, Any], workers: int | None) -> tuple[int, Any]:
    """Query the relation, the RCC-8 relation, the Boolean, and the relation of the swapped pair."""
    remaining = {"first_pose": poses[0], "second_pose": poses[1], "workers": workers}
    result = engine.collide(first, second, detail=_has_inside(first, second), **remaining)
    meets = engine.collide(first, second, boolean=True, **remaining).relation != engine.Relation.DISJOINT
    swapped = engine.collide(second, first, first_pose=poses[1], second_pose=poses[0], workers=workers).swapped()
    same(meets, result.relation != engine.Relation.DISJOINT, "yes or no")
    same(swapped.relation, result.relation, "two bodies")
    return 3, [result.relation, result.detail]


def witnessed(first: Any, second: Any, poses: tuple[Any, Any], workers: int | None) -> tuple[int, Any]:
    result = engine.collide(first, second, first_pose=poses[0], second_pose=poses[1], workers=workers)
    return 1, said(result.witness)


def posed(first: Any, second: Any, turns: Array, moves: Array, workers: int | None) -> tuple[int, Any]:
    queried = (first, second, turns, moves)
    meets = engine.collide_poses(*queried, boolean=True, workers=workers) != engine.Relation.DISJOINT
    relations = engine.collide_poses(*queried, workers=workers)
    same(meets, relations != engine.Relation.DISJOINT, "yes or no")
    return 2 * len(turns), relations


def posed_in_detail(first: Any, second: Any, turns: Array, moves: Array, workers: int | None) -> tuple[int, Any]:
    return len(turns), list(engine.collide_poses(first, second, turns, moves, detail=True, workers=workers))


def posed_witnessed(first: Any, second: Any, turns: Array, moves: Array, workers: int | None) -> tuple[int, Any]:
    _, witnesses = engine.collide_poses(first, second, turns, moves, witnesses=True, workers=workers)
    return len(turns), [said(witness) for witness in witnesses]


def parted(first: Any, second: Any, turns: Array, moves: Array, workers: int | None) -> tuple[int, Any]:
    """Query the distances, and whether they are at least the median."""
    distances = engine.clearance_poses(first, second, turns, moves, workers=workers)
    least = 1.001 * float(np.median(distances))  # no distance: those are rounded, the bound is not
    same(
        engine.clearance_poses(first, second, turns, moves, at_least=least, workers=workers),
        distances >= least,
        "a bound",
    )
    single = engine.clearance(first, second, second_pose=engine.Pose(turns[0], moves[0]), workers=workers)
    return 2 * len(turns) + 1, [distances, single.points, single.features]


def scene_collided(bodies: list[Any], poses: Any, options: dict[str, Any], workers: int | None) -> tuple[int, Any]:
    result = engine.collide_scene(bodies, poses, workers=workers, **options)
    return len(bodies), [result.first, result.second, result.relation, result.detail]


def scene_witnessed(bodies: list[Any], poses: Any, workers: int | None) -> tuple[int, Any]:
    result = engine.collide_scene(bodies, poses, witnesses=True, workers=workers)
    return len(bodies), [result.first, result.second, [said(witness) for witness in result.witnesses or ()]]


def triangles_collided(first: Array, second: Array, workers: int | None) -> tuple[int, Any]:
    relations = engine.collide_triangles(first, second, workers=workers)
    turned_ones = engine.collide_triangles(first[:, ::-1].copy(), np.roll(second, 1, axis=1), workers=workers)
    return 2 * len(first), same(turned_ones, relations, "vertices")


def _pair(draw: Draw, dimension: int, places: Any) -> tuple[Any, Any, tuple[Any, Any]]:
    place, makers = draw.pick(places), solids.COLLIDED[dimension]
    bodies = [draw.pick(makers)(draw, dimension, place).solid for _ in range(2)]
    if draw.chance(0.15):
        bodies[1] = bodies[0]
    poses = tuple(solids.pose(draw, dimension, place) if draw.chance(0.3) else None for _ in range(2))
    return bodies[0], bodies[1], (poses[0], poses[1])


def _touching(draw: Draw) -> Pair:
    """Return two meshes, a vertex of the second on one of the first's targets, exactly or an ulp off, or scaled in."""
    first, second = (draw.pick(shapes.MESHES)(draw) for _ in range(2))
    if draw.chance(0.3):
        second = first[0] * draw.pick([1.0, 0.5, 0.25]), first[1][:, ::-1] if draw.chance(0.5) else first[1]
    shape = solids.polyhedron_of(first)
    move = shape.targets[draw.one(0, len(shape.targets) - 1)] - second[0][draw.one(0, len(second[0]) - 1)]
    place = draw.pick(NEAR_PLACES)
    vertices = second[0] + move if draw.chance(0.6) else draw.nudged(second[0] + move)
    pair = solids.polyhedron_of(first, place), solids.polyhedron_of((vertices, second[1]), place)
    return pair[0].solid, pair[1].solid


def _pairs(ask: Any, n: int, places: Any) -> Drawn:
    """Return what draws so many pairs of any types in the plane, and as many in space."""
    return lambda draw: (partial(ask, *_pair(draw, dimension, places)) for dimension in (2, 3) for _ in range(n))


def _touching_meshes(ask: Any) -> Drawn:
    return lambda draw: (partial(ask, *_touching(draw), (None, None)) for _ in range(12))


family("collide", "pairs_of_any_types", 20, _pairs(collided, 40, NEAR_PLACES))
family("collide", "touching_meshes", 20, _touching_meshes(collided))
family("collide", "pairs_far_away", 10, _pairs(collided, 6, FAR_PLACES))
family("witnesses", "pairs_of_any_types", 12, _pairs(witnessed, 40, NEAR_PLACES))
family("witnesses", "touching_meshes", 12, _touching_meshes(witnessed))


def _poses(draw: Draw, dimension: int, n: int) -> tuple[Array, Array]:
    """Return n poses: lattice steps, small steps, anywhere; every other time one rotation for all."""
    turns = np.array([draw.rotation(dimension) for _ in range(n)])
    moves = [draw.whole(-6, 6, n, dimension) / 2.0, draw.whole(-3, 3, n, dimension) * 2.0**-40,
             draw.uniform(-8.0, 8.0, n, dimension)]  # fmt: skip
    if draw.chance(0.5):
        turns[:] = np.eye(dimension)
    return turns, np.stack(moves)[draw.whole(0, 2, n), np.arange(n)]


def _posed_pair(draw: Draw) -> Any:
    return draw.pick([shapes.smooth, shapes.bumpy, shapes.box, shapes.tetrahedron, shapes.frame, shapes.hollow])(draw)


@drawn_by("collide_poses", 16)
def posed_meshes(draw: Draw) -> Iterator[Question]:
    """Convex on convex by lanes, others by trees; few and many."""
    for n, ask in ((5, posed), (40, posed_in_detail), (150, posed)):
        pair = [solids.polyhedron_of(_posed_pair(draw)).solid for _ in range(2)]
        yield partial(ask, *pair, *_poses(draw, 3, n))
    convex = [solids.polyhedron_of(draw.pick([shapes.smooth, shapes.box])(draw)).solid for _ in range(2)]
    yield partial(posed, *convex, *_poses(draw, 3, 600))


@drawn_by("collide_poses", 14)
def posed_pairs_of_any_types(draw: Draw) -> Iterator[Question]:
    for dimension in (2, 3):
        for _ in range(5):
            pair = _pair(draw, dimension, (HOME,))[:2]
            yield partial(posed, *pair, *_poses(draw, dimension, 15))
            if _has_inside(*pair):
                yield partial(posed_in_detail, *pair, *_poses(draw, dimension, 5))


@drawn_by("clearance", 12)
def parted_pairs_of_any_types(draw: Draw) -> Iterator[Question]:
    for dimension in (2, 3):
        for _ in range(6):
            turns, moves = _poses(draw, dimension, 12)
            yield partial(parted, *_pair(draw, dimension, (HOME,))[:2], turns, 2.0 * moves)


@drawn_by("witnesses", 4)
def faces_of_many_vertices(draw: Draw) -> Iterator[Question]:
    for _ in range(12):
        pair = solids.prism(draw).solid, draw.pick([solids.prism, solids.polyhedron, solids.sphere])(draw, 3).solid
        yield partial(witnessed, *pair, (None, solids.pose(draw, 3) if draw.chance(0.5) else None))


family("witnesses", "posed_witnesses", 6, lambda draw: (
    partial(posed_witnessed, *_pair(draw, dimension, (HOME,))[:2], *_poses(draw, dimension, 12))
    for dimension in (2, 3) for _ in range(3)
))  # fmt: skip


def _bodies(draw: Draw, dimension: int, n: int, makers: Any) -> tuple[list[Any], list[Any]]:
    """Return n bodies, each a fourth of them one solid under other poses, so spread that a few meet each."""
    distinct = [
        draw.pick(makers)(draw, dimension, draw.pick([HOME, HOME, (0.25, 0.0)])).solid for _ in range(1 + n // 4)
    ]
    side = max(1, round(n ** (1.0 / dimension) * 3.0))
    moves = draw.whole(-side, side, n, dimension).astype(float)
    turns = [draw.rotation(dimension) if draw.chance(0.3) else np.eye(dimension) for _ in range(n)]
    poses = [engine.Pose(turn, move) if draw.chance(0.9) else None for turn, move in zip(turns, moves)]
    return [draw.pick(distinct) for _ in range(n)], poses


def _named(draw: Draw, n: int, n_pairs: int) -> Array:
    return draw.whole(0, n - 1, n_pairs, 2)


@drawn_by("collide_scene", 12)
def scenes_with_all_options(draw: Draw) -> Iterator[Question]:
    for dimension, n in (draw.pick([(2, 12), (2, 40)]), draw.pick([(3, 10), (3, 20)])):
        bounded = [maker for maker in solids.COLLIDED[dimension] if maker is not solids.surface]
        bodies, poses = _bodies(draw, dimension, n, bounded)
        for options in ({"detail": True}, {"skip": _named(draw, n, 20)}, {"only": _named(draw, n, 60), "detail": True},
                        {"boolean": True}):  # fmt: skip
            yield partial(scene_collided, bodies, poses, options)
        bodies, poses = _bodies(draw, dimension, n, solids.COLLIDED[dimension])
        yield partial(scene_collided, bodies, poses, {"boolean": draw.chance(0.5)})


@drawn_by("collide_scene", 10)
def large_scenes(draw: Draw) -> Iterator[Question]:
    """Unposed boxes on a lattice; convex bodies; enough bodies for the grid, and one too large for it."""
    for dimension in (2, 3):
        ends = np.sort(
            draw.whole(0, 60 if dimension == 2 else 24, 900, 1, dimension) + draw.whole(0, 4, 900, 2, dimension), 1
        )
        boxes: list[Any] = [engine.Aabb(low, high) for low, high in ends]
        yield partial(scene_collided, boxes, None, {})
        yield partial(
            scene_collided, [*boxes, engine.Aabb(np.zeros(dimension), np.full(dimension, 70))], None, {"detail": True}
        )
    convex = [
        solids.aabb,
        solids.sphere,
        lambda draw, *_: solids.polyhedron_of(draw.pick([shapes.smooth, shapes.box])(draw)),
    ]
    bodies, poses = _bodies(draw, 3, 300, convex)
    yield partial(scene_collided, bodies, poses, {"boolean": draw.chance(0.5)})


family("witnesses", "scene_witnesses", 6, lambda draw: (
    partial(scene_witnessed, *_bodies(draw, dimension, 25, solids.COLLIDED[dimension])) for dimension in (2, 3)
))  # fmt: skip


def _triangles(draw: Draw, n: int, dimension: int, place: Any) -> tuple[Array, Array]:
    """Return pairs on a lattice, anywhere, sharing vertices or edges, coplanar, an ulp off, without area."""
    lattice, anywhere = draw.whole(-2, 2, 2, n, 3, dimension).astype(float), draw.uniform(-2.0, 2.0, 2, n, 3, dimension)
    first, second = np.where(draw.unit(1, n, 1, 1) < 0.6, lattice, anywhere)
    second = np.where(draw.unit(n, 3, 1) < 0.25, np.roll(first, 1, axis=1), second)
    middles = first * 0.5 + np.roll(first, 1, axis=1) * 0.5
    second = np.where(draw.unit(n, 3, 1) < 0.1, middles, second)
    if dimension == 3:
        flat = draw.unit(n) < 0.3
        first[flat, :, 2] = second[flat, :, 2] = 0.5
    if draw.chance(0.4):
        first, second = turned(first, draw.rotation(dimension)), turned(second, draw.rotation(dimension))
    if draw.chance(0.5):
        second = draw.nudged(second)
    return first * place[0] + place[1], second * place[0] + place[1]


def _triangle_pairs(n: int, places: Any) -> Drawn:
    return lambda draw: (
        partial(triangles_collided, *_triangles(draw, n, dimension, draw.pick(places))) for dimension in (2, 3)
    )


family("collide_triangles", "triangles_near", 24, _triangle_pairs(1000, NEAR_PLACES))
family("collide_triangles", "triangles_far_away", 10, _triangle_pairs(60, FAR_PLACES))
