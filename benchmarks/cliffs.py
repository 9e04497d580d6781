"""Growth on awkward input: each operation at n, 4n, 16n, 64n, exponents and peers; fails on a cliff.

    python -m benchmarks cliffs                  # all families, some minutes
    python -m benchmarks cliffs --small          # the first two sizes
    python -m benchmarks cliffs --only overlay

CPU time, one thread, the least of three runs. A family ends where a run takes longer than `--most` seconds. It fails
where the last step grows by an exponent above 1.35, or where a peer is more than three times as fast as us (of parcels:
1 / 0.15), twice in a row; times below 2 ms say nothing of growth. Peers are asked where they are installed: shapely,
Open3D, coal.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from math import log
from typing import Any, NamedTuple

import numpy as np

import engine
from benchmarks import awkward, contenders
from benchmarks.answers.shapes import BOX, corners
from benchmarks.contenders import Placed
from benchmarks.measure import clocked
from benchmarks.polygon_pairs import parcels
from benchmarks.workloads import Mesh, Rings

try:
    import shapely
except ImportError:
    shapely = None  # type: ignore[assignment]

EXPONENT, PEER, LEAST = 1.35, 3.0, 2e-3
UNIT = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
Ask = Callable[[], object]


class Family(NamedTuple):
    """One question at growing sizes: make(n) returns it, and a peer's or None; sizes: n, 4n, 16n, 64n. most: how many
    times as fast a peer may be."""

    name: str
    first: int
    make: Callable[[int], tuple[Ask, Ask | None]]
    most: float = PEER


def _draw(n: int) -> np.random.Generator:
    return np.random.default_rng(n)


def _solid(net: awkward.Net) -> engine.Polyhedron:
    return engine.Polyhedron(*net)


def _peer(module: str, kind: str, subject: Any, items: Any, is_new: bool = False) -> Ask | None:
    """Return a question to a contender, None where its package is not installed; is_new: the build is part of it."""
    try:
        made = contenders.make(module, kind, subject, 1)
    except (ImportError, OSError):
        return None
    if is_new:
        return partial(contenders.answers, module, kind, subject, items)
    return partial(made.ask, made.native(items))


# --- points -----------------------------------------------------------------------------------------------------------


def _points_in_fresh_mesh(
    shape: Callable[[int], awkward.Net], n: int, at_vertices: bool = False
) -> tuple[Ask, Ask | None]:
    net = shape(n)
    points = _draw(n).uniform(net[0].min(0), net[0].max(0), (2000, 3))
    points = net[0][_draw(n).integers(len(net[0]), size=2000)] if at_vertices else points
    return lambda: engine.locate(points, _solid(net), workers=1), _peer(
        "open3d", "points", Mesh("", *net), points, True
    )


def _points_on_one_face(n: int) -> tuple[Ask, None]:
    net = awkward.torus(n)
    solid, points = _solid(net), np.repeat(net[0][net[1][:1, :2]].mean(1), 20_000, 0)
    return lambda: engine.locate(points, solid, workers=1), None


def _points_in_fresh_polygon(
    shape: Callable[[int], np.ndarray], n: int, is_one_by_one: bool = False
) -> tuple[Ask, Ask | None]:
    ring = shape(n)
    points = _draw(n).uniform(ring.min(0), ring.max(0), (10_000, 2))
    if is_one_by_one:
        few, polygon = points[:200, None], engine.Polygon([ring])
        return lambda: [engine.locate(point, polygon) for point in few], None
    peer = _peer("shapely", "points", Rings("", [ring]), points, True)
    return lambda: engine.locate(points, engine.Polygon([ring]), workers=1), peer


# --- segments ---------------------------------------------------------------------------------------------------------


def _segments(shape: Callable[[int], awkward.Net], n: int, along_edges: bool = False) -> tuple[Ask, None]:
    net = shape(n)
    solid = _solid(net)
    ends = _draw(n).uniform(net[0].min(0), net[0].max(0), (500, 2, 3))
    segments = net[0][net[1][:500, :2]] if along_edges else ends
    return lambda: engine.clip_segments(segments, solid, workers=1), None


def _segments_along_a_side(n: int) -> tuple[Ask, Ask | None]:
    ring, segments = awkward.zigzag(n), np.repeat([[[-1.0, 0.0], [2.0, 0.0]]], 20, 0)
    polygon = engine.Polygon([ring])
    peer = _peer("shapely", "pieces", Rings("", [ring]), segments)
    return lambda: engine.clip_segments(segments, polygon, workers=1), peer


def _segments_through(bodies: Callable[[int], list[engine.Solid]], n: int) -> tuple[Ask, None]:
    solids = bodies(n)
    ends = _draw(n).uniform(0, n ** (1 / 3), (2000, 2, 3))
    return lambda: engine.Scene(solids).clip_segments(ends, workers=1), None


# --- bodies -----------------------------------------------------------------------------------------------------------


def _two(shape: Callable[[int], awkward.Net], move: Any, n: int, is_distance: bool = False) -> tuple[Ask, Ask | None]:
    net = shape(n)
    first, second = _solid(net), _solid(net)
    pose = engine.Pose(np.eye(3), move(net) if callable(move) else move)
    couple = Placed(Mesh("", *net)), Placed(Mesh("", *net), (np.eye(3), pose.translation))
    ask = engine.clearance if is_distance else engine.collide
    peer = _peer("coal", "clearance pairs", None, [couple]) if is_distance else _peer("coal", "pair", couple, None)
    return partial(ask, first, second, second_pose=pose), peer


def _apex(gap: float, net: awkward.Net) -> np.ndarray:
    return (net[0][-2] - net[0][-1]) * (1.0 + gap)


def _scene(bodies: Callable[[int], list[engine.Solid]], n: int) -> tuple[Ask, None]:
    solids = bodies(n)
    return lambda: engine.collide_scene(solids, workers=1), None


def _cubes(n: int) -> list[engine.Solid]:
    """Boxes that touch, as meshes."""
    return [engine.Polyhedron(corners(box.min, box.max), BOX) for box in awkward.boxes_in_rows(n)]


def _one_and_many(n: int) -> list[engine.Solid]:
    return [engine.Aabb([-1.0] * 3, [1e3] * 3), *(engine.Aabb(at, at + 1) for at in _draw(n).uniform(0, 990, (n, 3)))]


# --- the plane --------------------------------------------------------------------------------------------------------


def _parcels(shift: float, n: int) -> tuple[Ask, Ask | None]:
    rings = parcels(n, n, shift)
    polygons = [engine.Polygon([ring]) for ring in rings]
    ask = partial(engine.collide_scene, polygons, workers=1)
    if shapely is None:
        return ask, None
    shapes = shapely.polygons(rings)
    return ask, lambda: shapely.STRtree(shapes).query(shapes, predicate="intersects")


def _rings(name: str, first: np.ndarray, second: np.ndarray) -> tuple[Ask, Ask | None]:
    """Two polygons of one ring each; name: collide, clearance or an operation of overlay."""
    a, b = engine.Polygon([first]), engine.Polygon([second])
    couple = Placed(Rings("", [first])), Placed(Rings("", [second]))
    if name == "collide":
        layers = first[None], second[None]
        return partial(engine.collide, a, b), _peer("shapely", "relations of polygons", layers, np.zeros((1, 2), int))
    if name == "clearance":
        return partial(engine.clearance, a, b), _peer("shapely", "clearance pairs", None, [couple])
    peer = _peer("shapely", "overlay of made", name, [([first], [second])])
    return lambda: engine.overlay(a, b, name), peer  # type: ignore[arg-type]


def _side_by_side(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Two squares with n corners each on the side they share."""
    side = np.column_stack([np.linspace(0.0, 1.0, n), np.zeros(n)])
    return np.concatenate([side, UNIT[2:]]), np.concatenate([side[::-1], UNIT[:2] - [0.0, 1.0]])


def _moved(ring: np.ndarray, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    return ring, ring + np.array([x, y])


def _union(rings: Callable[[int], Any], n: int) -> tuple[Ask, Ask | None]:
    made = rings(n)
    polygons = [engine.Polygon([ring]) for ring in made]
    peer = None if shapely is None else partial(shapely.union_all, [shapely.Polygon(ring) for ring in made])
    return partial(engine.union_all, polygons, workers=1), peer


def _clipped(ring: np.ndarray, region: engine.Solid, outline: np.ndarray) -> tuple[Ask, Ask | None]:
    peer = _peer("shapely", "overlay of made", "intersection", [([ring], [outline])])
    return lambda: engine.clip_polygons([[ring]], region, workers=1), peer


_MESHES: dict[str, Callable[[int], awkward.Net]] = {
    "torus": awkward.torus,
    "bipyramid": awkward.bipyramid,
    "flat bipyramid": partial(awkward.bipyramid, height=1e-6),
    "stretched 1e5": partial(awkward.torus, stretch=(1e5, 1, 1)),
    "flattened 1e-6": partial(awkward.torus, stretch=(1, 1, 1e-6)),
    "spiky": awkward.spiky,
    "block": awkward.block,
}
_OUTLINES: dict[str, Callable[[int], np.ndarray]] = {
    "circle": awkward.unit_circle,
    "star": awkward.star,
    "tall comb": partial(awkward.comb, height=1e4),
    "spiral": awkward.spiral,
    "zigzag": awkward.zigzag,
}
FAMILIES = [
    *(Family(f"locate: fresh {name}", 1000, partial(_points_in_fresh_mesh, shape))
      for name, shape in _MESHES.items()),
    Family("locate: at vertices", 1000, partial(_points_in_fresh_mesh, awkward.torus, at_vertices=True)),
    Family("locate: equal points on a face", 1000, _points_on_one_face),
    *(Family(f"locate: fresh {name}", 1000, partial(_points_in_fresh_polygon, ring))
      for name, ring in _OUTLINES.items()),
    Family("locate: polygon, point by point", 1500,
           partial(_points_in_fresh_polygon, awkward.star, is_one_by_one=True)),
    *(Family(f"clip_segments: {name}", 500, partial(_segments, shape)) for name, shape in _MESHES.items()),
    *(Family(f"clip_segments: edges of {name}", 500, partial(_segments, shape, along_edges=True))
      for name, shape in _MESHES.items() if name in ("torus", "stretched 1e5", "block")),
    Family("clip_segments: along a side of a polygon", 300, _segments_along_a_side),
    Family("scene, segments: boxes that touch", 512, partial(_segments_through, awkward.boxes_in_rows)),
    Family("scene, segments: equal boxes", 16,
           partial(_segments_through, lambda n: [engine.Aabb([0.0] * 3, [2.0] * 3)] * n)),
    Family("collide: itself", 1000, partial(_two, awkward.torus, [0, 0, 0])),
    Family("collide: itself, 1e-12 off", 1000, partial(_two, awkward.torus, [1e-12, 0, 0])),
    Family("collide: stretched 1e5", 1000, partial(_two, _MESHES["stretched 1e5"], [0, 0.5, 0.1])),
    Family("collide: blocks 1e-9 apart", 1000, partial(_two, awkward.block, [0.5, 0.25, 1 + 1e-9])),
    Family("collide: blocks flush", 1000, partial(_two, awkward.block, [0, 0, 1])),
    Family("collide: apex to apex", 1000, partial(_two, awkward.bipyramid, partial(_apex, 0.0))),
    Family("collide: apexes 1e-9 apart", 1000, partial(_two, awkward.bipyramid, partial(_apex, 1e-9))),
    Family("collide: spikes through spikes", 500, partial(_two, awkward.spiky, [0.5, 0.4, 0.1])),
    Family("clearance: tori", 1000, partial(_two, awkward.torus, [3, 0.1, 0.2], is_distance=True)),
    Family("clearance: blocks 0.5 apart", 250, partial(_two, awkward.block, [0, 0, 1.5], is_distance=True)),
    Family("scene: boxes that touch", 512, partial(_scene, awkward.boxes_in_rows)),
    Family("scene: cubes as meshes, flush", 64, partial(_scene, _cubes)),
    Family("scene: a huge box and tiny ones", 1000, partial(_scene, _one_and_many)),
    Family("scene: parcels", 256, partial(_parcels, 0.0), 1 / 0.15),
    Family("scene: parcels, moved corners", 256, partial(_parcels, 0.2), 1 / 0.15),
    Family("collide: squares with a side of n parts", 64, lambda n: _rings("collide", *_side_by_side(n))),
    Family("clearance: circle beside circle", 1000,
           lambda n: _rings("clearance", *_moved(awkward.unit_circle(n), 2.2, 0.3))),
    Family("clearance: combs", 400,
           lambda n: _rings("clearance", awkward.comb(n), _moved(awkward.comb(n) * [1, -1], 0.3, 3.0)[1])),
    Family("overlay: circle and the next doubles", 250,
           lambda n: _rings("intersection", awkward.unit_circle(n), np.nextafter(awkward.unit_circle(n), 9))),
    Family("overlay: equal combs", 1000, lambda n: _rings("union", awkward.comb(n), awkward.comb(n))),
    Family("overlay: spirals", 500, lambda n: _rings("intersection", *_moved(awkward.spiral(n), 0.313, 0.177))),
    Family("overlay: stars", 500, lambda n: _rings("union", *_moved(awkward.star(n, 1.0 - 2.0 / n), 0.31, 0.17))),
    Family("union_all: parcels", 256, partial(_union, lambda n: parcels(n, n, 0.0))),
    Family("union_all: equal squares", 1000, partial(_union, lambda n: [UNIT] * n)),
    Family("union_all: nested circles", 100,
           partial(_union, lambda n: [awkward.unit_circle(32) * k for k in range(1, n)])),
    Family("union_all: circles about one place", 64, partial(
        _union, lambda n: list(awkward.unit_circle(32) + _draw(n).normal(0.0, 0.1, (n, 1, 2))))),
    Family("union_all: scattered circles", 250, partial(
        _union, lambda n: list(awkward.unit_circle(32) * 0.5 + _draw(n).uniform(0, n**0.5, (n, 1, 2))))),
    Family("clip_polygons: star on n lines", 8, lambda n: _clipped(
        awkward.star(1000, 0.4) * 1.3, awkward.ngon(n), awkward.unit_circle(n) / np.cos(np.pi / n))),
    Family("clip_polygons: zigzag on a box", 1000,
           lambda n: _clipped(awkward.zigzag(n), engine.Aabb([0.0, 0.0], [1.0, 1.0]), UNIT)),
]  # fmt: skip


def least(ask: Ask, most: float) -> float:
    """Return the CPU seconds of the fastest of three runs, of one that takes long."""
    best = float("inf")
    for _ in range(3):
        best = min(best, clocked(ask)[1])
        if best > most / 4:
            break
    return best


def grown(family: Family, n_sizes: int, most: float) -> tuple[str, list[str]]:
    """Return the line of a family, and what is wrong with it."""
    line, faults, before = f"{family.name:44}", [], (0, 0.0)
    for n in (family.first * 4**k for k in range(n_sizes)):
        ask, peer = family.make(n)
        if not before[0]:
            ask()  # compiles
        ours = least(ask, most)
        line += f" | {n:>6} {1e3 * ours:9.3f} ms"
        exponent = log(ours / before[1]) / log(n / before[0]) if before[0] and before[1] > 0 < ours else 0.0
        if before[0]:
            line += f" ^{exponent:5.2f}"
            faults = [f"grows by {exponent:.2f}"] if exponent > EXPONENT and ours > LEAST else []
        if peer is not None:
            theirs = least(peer, most)
            line += f" ({theirs / ours:6.2f})"
            faults += (
                [f"a peer is {ours / theirs:.1f} times as fast"] if ours > family.most * theirs and ours > LEAST else []
            )
        before = n, ours
        if ours > most:
            break
    return line, [f"{family.name}: {fault}" for fault in faults]


def main(words: list[str]) -> int:
    """Ask all families, print a line each, and fail on a cliff."""
    parser = argparse.ArgumentParser(prog="benchmarks cliffs", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--small", action="store_true", help="the first two sizes of each family")
    parser.add_argument("--only", default="", help="families whose name contains this")
    parser.add_argument("--most", type=float, default=4.0, help="seconds from which a family grows no further")
    options = parser.parse_args(words)
    print("n, CPU time, exponent since the size before (peer's time over ours)")
    faults = []
    for family in FAMILIES:
        if options.only in family.name:
            for _ in range(2):
                line, found = grown(family, 2 if options.small else 4, options.most)
                print(line, flush=True)
                if not found:
                    break
            faults += found
    print("\n".join(faults) or "no cliff")
    return int(bool(faults))
