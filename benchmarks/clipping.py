"""Speed and error of clipping, row by row: ``python -m benchmarks.clipping [--quick]``.

All rows but the last two are of one thread. Regions are solids of ours; each peer reads its own form from them.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

import engine
from benchmarks import workloads
from benchmarks.contenders import Absent, Prepared, load
from benchmarks.measure import interleaved, ratios
from benchmarks.suite import Row, Suite, options

try:
    from tests.reference.segments import clip_segment
    from tests.reference.sutherland_hodgman import clip_contour, planes_of, rounded, same_cycle
except ImportError as error:  # the reference needs gmpy2
    UNCHECKED = f"exact answers need {error.name}, of the extra test"
else:
    UNCHECKED = ""

Task = tuple[str, Callable[[str], Iterable[Row]]]
Goals = tuple[float | None, float | None]

RINGS = (4, 10, 30, 100)


def tasks(suite: Suite) -> Iterator[Task]:
    """Yield the rows of the table in its order."""
    n = suite.options.n_points
    cube, square = engine.Aabb([-1.0] * 3, [1.0] * 3), engine.Aabb([-1.0] * 2, [1.0] * 2)
    for kind, goals in {"random": (0.65, 1.0), "corner": (0.3, 0.6), "edge": (0.3, 0.6), "ulp": (0.3, 0.6)}.items():
        name = f"segments on aabb, {kind} vs naive"
        yield name, partial(_segments, suite, cube, "naive_clipping", kind, n, goals)
    planes = engine.Convex(workloads.convex_planes(20, suite.options.seed).rows)
    yield (
        "segments on 20 planes vs naive",
        partial(_segments, suite, planes, "naive_clipping", "random", n, (0.37, 0.7)),
    )
    ball = engine.Sphere([0.0] * 3, 1.0)
    yield "segments on sphere vs naive", partial(_segments, suite, ball, "naive_clipping", "random", n, (0.1, 0.3))
    for peer, goals in {"celltree_segments": (0.7, 1.0), "shapely_clipping": (10.0, 20.0)}.items():
        name = f"segments on aabb, 2D vs {peer.split('_')[0]}"
        yield name, partial(_segments, suite, square, peer, "random", n, goals)
    size = "1k" if suite.options.quick else "86k"
    yield f"segments on {size} faces vs trimesh, embree", partial(_mesh, suite, size)
    for size_ in RINGS[:2] if suite.options.quick else RINGS:
        for peer, goals in {"naive_clipping": (0.5, 0.65), "shapely_clipping": (4.0, 8.0)}.items():
            name = f"polygons of {size_} on aabb, 2D vs {peer.split('_')[0]}"
            yield name, partial(_polygons, suite, square, peer, size_, n, goals)
        name = f"polygons of {size_} on aabb, 3D vs naive"
        yield name, partial(_polygons, suite, cube, "naive_clipping", size_, n, (0.5, 0.65))
    for peer in ("trimesh_clipping", "vtk_clipping"):
        name = f"triangles on aabb, 3D vs {peer.split('_')[0]}, six times"
        yield name, partial(_polygons, suite, cube, peer, 3, n, (15.0, 25.0))
    yield "two threads, segments on aabb", partial(_two_threads, suite, cube)
    yield "two threads, segments on 20 planes", partial(_two_threads, suite, planes)


def _our_segments(region: engine.Solid, threads: int) -> Prepared:
    def ask(segments: np.ndarray) -> engine.SegmentPieces:
        return engine.clip_segments(segments, region, workers=threads)

    return Prepared(lambda segments: segments, ask, lambda pieces: pieces.source)


def _segments(
    suite: Suite, region: engine.Solid, peer: str, kind: str, n: int, goals: Goals, name: str
) -> Iterable[Row]:
    segments = workloads.segments_of(kind, region.dimension, n, suite.options.seed)
    yield _row(suite, name, goals, _our_segments(region, 1), peer, "segments", region, segments, _check_segments)


def _check_segments(suite: Suite, region: engine.Solid, segments: np.ndarray, ours: Any, peer: Any) -> str:
    """Settle a sample of ours by the reference, and count the peer's decisions against ours, which that proves."""
    kept = np.zeros(len(segments), bool)
    kept[ours.source] = True
    told = f"peer decides {np.count_nonzero(kept != peer)} of {len(segments)} otherwise" if len(peer) else ""
    if UNCHECKED or isinstance(region, engine.Polyhedron):
        return told or UNCHECKED
    chosen = random.Random(suite.options.seed).sample(range(len(segments)), 300)
    wrong = 0
    for i in chosen:
        rows = np.flatnonzero(ours.source == i)
        found = [(ours.start[r].tolist(), ours.end[r].tolist(), ours.t[r].tolist()) for r in rows]
        wrong += found != [tuple(piece.rounded()) for piece in clip_segment(segments[i].tolist(), as_json(region))]
    return f"wrong: ours {wrong} of 300 settled; {told}"


def as_json(region: engine.Solid) -> dict[str, Any]:
    """Return a region as the reference reads it."""
    match region:
        case engine.Aabb():
            return {"type": "aabb", "min": region.min.tolist(), "max": region.max.tolist()}
        case engine.Convex():
            return {"type": "convex", "planes": region.planes.tolist()}
        case engine.Sphere():
            return {"type": "sphere", "center": region.center.tolist(), "radius": region.radius}
    raise TypeError(region.type)


def _mesh(suite: Suite, size: str, name: str) -> Iterable[Row]:
    """Segments between two random points of the mesh's box, of about its size."""
    mesh = workloads.mesh_of_size(size, suite.options.seed)
    solid = engine.Polyhedron(mesh.vertices, mesh.faces)
    ends = workloads.uniform_points(mesh, suite.options.n_points // 5, suite.options.seed)
    segments = np.ascontiguousarray(ends.reshape(-1, 2, 3))
    goals = (3.0, 10.0)
    ours = _our_segments(solid, 1)
    yield _row(suite, name, goals, ours, "trimesh_clipping", "segments", solid, segments, _check_mesh)


def _check_mesh(suite: Suite, region: engine.Solid, segments: np.ndarray, ours: Any, peer: Any) -> str:
    crossed = np.bincount(ours.source[(ours.faces >= 0).any(axis=1)], minlength=len(segments)) > 0
    return f"peer finds a hit or none otherwise than ours on {np.count_nonzero(crossed != peer)} of {len(segments)}"


def _polygons(
    suite: Suite, region: engine.Aabb, peer: str, size: int, n_vertices: int, goals: Goals, name: str
) -> Iterable[Row]:
    """Polygons of one ring: stars in the plane, turned anyhow in space (so hardly ever planar)."""
    rings = workloads.star_rings(size, region.dimension, n_vertices // 4 // size, suite.options.seed)

    def ask(polygons: np.ndarray) -> engine.ClippedPolygons:
        return engine.clip_polygons(polygons, region, workers=1)

    ours = Prepared(lambda polygons: polygons, ask, lambda found: np.diff(found.polygon_offsets) > 0)
    yield _row(suite, name, goals, ours, peer, "polygons", region, rings, _check_polygons)


def _check_polygons(suite: Suite, region: engine.Solid, rings: np.ndarray, ours: Any, peer: Any) -> str:
    kept = np.diff(ours.polygon_offsets) > 0
    told = f"peer keeps {np.count_nonzero(kept != peer)} of {len(rings)} otherwise" if len(peer) else ""
    if UNCHECKED:
        return told or UNCHECKED
    planes, wrong, n_sample = planes_of(as_json(region)), 0, min(100, len(rings))
    for i in random.Random(suite.options.seed).sample(range(len(rings)), n_sample):
        expected = rounded(clip_contour(rings[i].tolist(), planes))
        found = [ring.tolist() for ring in ours.rings(i)]
        wrong += not (same_cycle(found[0], expected) if found else not expected)
    return "; ".join(part for part in (f"wrong: ours {wrong} of {n_sample} settled", told) if part)


def _two_threads(suite: Suite, region: engine.Solid, name: str) -> Iterable[Row]:
    segments = workloads.segments_of("random", region.dimension, suite.options.n_points, suite.options.seed)
    one, two = _our_segments(region, 1), _our_segments(region, 2)
    runs = [lambda: two.ask(segments), lambda: one.ask(segments)]
    (a, b), _ = interleaved(runs, suite.options.rounds, suite.options.seconds)
    wall, _ = ratios(a, b)
    row = Row(name, "x", 1.7, 1.9, wall.median, wall.low, wall.high)
    row.ours, row.peer = (f"{len(segments) / timing.median / 1e6:.3g} M/s" for timing in (a, b))
    yield row


def _row(
    suite: Suite,
    name: str,
    goals: Goals,
    ours: Prepared,
    peer_name: str,
    kind: str,
    region: engine.Solid,
    items: np.ndarray,
    check: Callable[..., str],
) -> Row:
    row, module = Row(name, "x", *goals), load(peer_name)
    if isinstance(module, Absent):
        row.note = f"{peer_name} does not run here: {module.reason}"
        return row
    peer = module.MAKERS[kind](region, 1)
    asked = peer.native(items)
    runs = [lambda: ours.ask(items), lambda: peer.ask(asked)]
    (a, b), results = interleaved(runs, suite.options.rounds, suite.options.seconds)
    wall, cpu = ratios(a, b)
    row.value, row.low, row.high, row.cpu_value = wall.median, wall.low, wall.high, cpu.median
    row.ours, row.peer = (f"{len(items) / timing.median / 1e6:.3g} M/s" for timing in (a, b))
    row.error = check(suite, region, items, results[0], peer.answer(results[1]))
    row.raw = {"ours": asdict(a), "peer": asdict(b), "n_items": len(items)}
    return row


def main(words: list[str] | None = None) -> int:
    """Run the suite; the exit code is 0 also where a row misses its goal: the table says so."""
    suite = Suite("clipping", options(words, __doc__ or ""))
    suite.run(tasks(suite))
    return 0


if __name__ == "__main__":
    sys.exit(main())
