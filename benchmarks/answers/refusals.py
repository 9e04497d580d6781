"""Questions to bounds, and what constructors and operations refuse: names, codes, places and messages."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks.answers import shapes, solids
from benchmarks.answers.asking import Question, answered, family
from benchmarks.answers.draws import FAR_PLACES, NEAR_PLACES, Draw


def bounded(solid: Any, workers: int | None) -> tuple[int, Any]:
    found = engine.bounds(solid, workers=workers)
    return 1, [found.aabb.min, found.aabb.max, found.sphere.center, found.sphere.radius]


_BOUNDED = {
    2: (solids.sphere, solids.aabb, solids.triangle, solids.polygon, solids.convex),
    3: (solids.sphere, solids.aabb, solids.triangle, solids.polyhedron, solids.surface, solids.convex),
}


@family("bounds", 20)
def bounds_of_all_solids(draw: Draw) -> Iterator[Question]:
    for dimension, makers in _BOUNDED.items():
        for maker in makers * 5:
            yield partial(bounded, maker(draw, dimension, draw.pick(NEAR_PLACES)).solid)


@family("bounds", 5)
def bounds_far_away(draw: Draw) -> Iterator[Question]:
    for dimension, makers in _BOUNDED.items():
        for maker in makers:
            yield partial(bounded, maker(draw, dimension, draw.pick(FAR_PLACES)).solid)


@family("bounds", 4)
def bounds_of_many_vertices(draw: Draw) -> Iterator[Question]:
    yield partial(bounded, solids.polyhedron_of(shapes.ball(draw, 4, draw.pick([0.0, 0.2]))).solid)
    yield partial(bounded, solids.polygon_of(shapes.large_coast(draw)).solid)


INF, NAN = float("inf"), float("nan")
CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
BALL = engine.Sphere([0.0, 0.0, 0.0], 1.0)
APART = engine.Polyhedron(
    CORNERS + [[x + 2.0, y, z] for x, y, z in CORNERS], FACES + [[a + 4, b + 4, c + 4] for a, b, c in FACES]
)
DISC = engine.Sphere([0.0, 0.0], 1.0)
REFUSED: dict[str, tuple[tuple[Any, ...], ...]] = {
    "Aabb": (([0, 0], [1, -1]), ([0, 0], [1, 1, 1]), ([0], [1]), ([NAN, 0], [1, 1]), ("ab", [1, 1]),
                ([0, 10**400], [1, 1])),
    "Sphere": (([0, 0], -1.0), ([0, 0], INF), ([0, 0], "1"), ([0, True], 1), ([], 1), ([0, 0, 0, 0], 1), ([[0, 0]], 1)),
    "HalfSpace": (([0, 0], 1), ([0.0, -0.0, 0], 1), ([1, 0], NAN), ([1], 0), (None, 0), ([2**60 + 1, 1], 0)),
    "Convex": (([],), ([[0, 0, 1]],), ([[1, 0, 1], [1, 0]],), ([[1, 0]],), ([[1, 0, 0, INF]],), (3,),
                ([[1, 2, 3, 4, 5]],)),
    "Triangle": (([[0, 0], [1, 1]],), ([[0], [1], [2]],), ([[0, 0], [1, 1], [2, NAN]],),
                ([[0, 0], [1, 1], [2, 2, 2]],)),
    "Polygon": (([],), ([[[0, 0], [1, 1]]],), ([[[0, 0], [1, 1], [0, 0]]],), ([[0, 0], [1, 1], [2, 2]],), (None,),
                ([[[0, 0, 0], [1, 1, 1], [2, 0, 1]]],), ([[[0, 0], [1, 1], [INF, 0]]],),
                ([[[0, 0], [1, 1], [2, "x"]]],)),
    "Polyhedron": ((CORNERS, FACES[:3]), (CORNERS, [*FACES[:3], [0, 2, 3]]), (CORNERS, [[0, 1, 4]]),
                (CORNERS, [[0, 1, 1]]),
                   (CORNERS, []), ([], FACES), (CORNERS, [[0, 1]]), (CORNERS, [[0, 1, -1]]), (CORNERS, [[0.5, 1, 2]]),
                   ([[0, 0], [1, 0], [0, 1]], FACES), ([*CORNERS[:3], [0, 0, NAN]], FACES), (CORNERS, [[0, 2, 1, 3]]),
                   (CORNERS, FACES * 2), ([*CORNERS, [0.2, 0.2, 0.0]], [[0, 2, 4, 1], *FACES[1:], [0, 1, 2, 4]])),
    "Surface": ((CORNERS, [[0, 1, 4]]), (CORNERS, [[0, 1, 1]]), (CORNERS, []), ([[0, 0, INF]] * 3, [[0, 1, 2]])),
    "Implicit": (([],), ([{"powers": [20, 0], "coefficient": 1.0}],), ([{"powers": [-1, 0], "coefficient": 1.0}],),
                 ([{"powers": [1, 0], "coefficient": NAN}],), ([{"powers": [1.5, 0], "coefficient": 1}],), ([{}],),
                 ([{"powers": [1, 0], "coefficient": 1}, {"powers": [1, 0, 0], "coefficient": 1}],), (None,)),
    "Csg": (("xor", [BALL]), ("union", []), ("difference", [BALL]), ("union", [BALL, DISC]), ("union", [3]),
                ("union", 3),
            ("union", [engine.Surface(CORNERS, FACES)])),
    "Pose": (([[1, 0], [0, 1.1]], [0, 0]), ([[1, 0], [0, -1]], [0, 0]), ([[1, 0, 0], [0, 1, 0]], [0, 0]),
                ([[1, 0], [0, 1]], [0]),
             ([[1, 0], [0, NAN]], [0, 0]), ([[0, 0], [0, 0]], [0, 0])),
    "locate": (([[0, 0]], BALL), ([[0, 0, NAN]], BALL), ([0, 0, 0], BALL),
                ([[0, 0, 0]], engine.Surface(CORNERS, FACES)),
               ([[0, 0, 0], [1, 1]], BALL), ("points", BALL), ([[0, 0, 0]], 3), (np.full((5, 3), INF), BALL)),
    "locate_scene": (([[0, 0]], [BALL]), ([[0, 0, 0]], [BALL, DISC]), ([[0, 0, 0]], [BALL], []), ([[0, 0, 0]], BALL),
                     ([[0, 0, 0]], [BALL], [3]), ([[0, 0, 0]], [engine.Surface(CORNERS, FACES)])),
    "collide": ((BALL, DISC), (BALL, 3), (engine.Convex([[1, 0, 0, 1]]), BALL), (BALL, engine.Csg("union", [BALL]))),
    "collide_poses": ((BALL, BALL, [[[1, 0], [0, 1]]], [[0, 0]]), (BALL, BALL, [np.eye(3) * 2], [[0, 0, 0]]),
                      (BALL, BALL, [np.eye(3)], []), (BALL, DISC, [np.eye(3)], [[0, 0, 0]])),
    "collide_scene": (([BALL, DISC],), ([BALL], [None, None]), (BALL,), ([BALL, 3],),
                ([BALL, engine.Convex([[1, 0, 0, 1]])],)),
    "collide_triangles": (([CORNERS], [CORNERS]), ([CORNERS[:3]], []), ([[[0, 0]] * 3], [CORNERS[:3]]),
                ([[[0, NAN]] * 3], [[[0, 0]] * 3])),
    "clip_segments": (([[[0, 0], [1, 1]]], BALL), ([[[0, 0, 0]]], BALL), ([[[0, 0, 0], [1, 1, INF]]], BALL),
                      ([[[0, 0, 0], [1, 1, 1]]], engine.Csg("union", [BALL])), ([[0, 0, 0]], BALL)),
    "clip_polygons": (([[CORNERS]], APART), ([[CORNERS]], BALL), ([[]], engine.Aabb([0, 0], [1, 1])),
                      ([[[]]], engine.Aabb([0, 0], [1, 1])),
                      ([[CORNERS]], engine.Aabb([0, 0], [1, 1])), (3, engine.Aabb([0, 0], [1, 1])),
                      ([[[[0, NAN], [1, 1]]]], engine.Aabb([0, 0], [1, 1]))),
    "overlay": ((DISC, DISC),
                (engine.Polygon([[[0, 0], [1, 0], [0, 1]]]), engine.Polygon([[[0, 0], [1, 0], [0, 1]]]), "xor"),
                (BALL, 3),
                (engine.Polygon([[[0, 0], [1e308, 0], [0, 1e308]]]), engine.Polygon([[[0, 0], [1, 0], [0, 1]]]), None)),
    "overlay_batch": ((DISC, []), ([DISC], []), ([DISC], [DISC]), ([], [], "or")),
    "bounds": ((engine.HalfSpace([1, 0], 0),), (engine.Convex([[1, 0, 0]]),),
                (engine.Convex([[1, 0, -1], [-1, 0, 0]]),),
               (engine.Implicit([{"powers": [1, 0], "coefficient": 1}]),), (engine.Csg("union", [BALL]),), (3,)),
}  # fmt: skip
"""Arguments of each public name that it refuses."""


@family("refusals", 1)
def arguments_refused(draw: Draw) -> Iterator[Question]:
    for name, rows in REFUSED.items():
        for row in rows:
            yield partial(_refused, name, row)


def _refused(name: str, row: tuple[Any, ...], workers: int | None) -> tuple[int, Any]:
    def ask(workers: int | None) -> tuple[int, Any]:
        getattr(engine, name)(*row)
        return 1, "accepted"

    return 1, [name, answered(ask, workers)[1]]


@family("refusals", 10)
def meshes_broken(draw: Draw) -> Iterator[Question]:
    """Good meshes with a face left out, turned, doubled or renamed: which element is named, and how."""
    for make in shapes.MESHES:
        vertices, faces = make(draw)
        broken = faces.copy()
        at = draw.one(0, len(faces) - 1)
        match draw.one(0, 4):
            case 0:
                broken = np.delete(broken, at, axis=0)
            case 1:
                broken[at] = broken[at][::-1]
            case 2:
                broken = np.concatenate([broken, broken[at : at + 1]])
            case 3:
                broken[at, 0] = draw.pick([-1, len(vertices), int(broken[at, 1])])
            case _:
                vertices = vertices.copy()
                vertices[draw.one(0, len(vertices) - 1), draw.one(0, 2)] = draw.pick([NAN, INF])
        yield partial(_refused, "Polyhedron", (vertices, broken))
        yield partial(_refused, "Surface", (vertices, broken))
