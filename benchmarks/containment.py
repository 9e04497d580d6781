"""Speed and error of containment, row by row: ``python -m benchmarks.containment [--quick]``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from functools import partial

import numpy as np

import engine
from benchmarks import memory, workloads
from benchmarks.contenders import Absent, Prepared, load
from benchmarks.measure import clocked, interleaved, ratios
from benchmarks.suite import Row, Suite, of_seconds, options, settle

SIZES = ("1k", "86k", "1.38M")
UNIFORM = {"1k": (10.0, 20.0), "86k": (20.0, 30.0), "1.38M": (30.0, 50.0)}
NEAR = {"1k": (6.0, 12.0), "86k": (6.0, 12.0), "1.38M": (7.0, 12.0)}
BUILD = {"86k": (0.8, 0.3), "1.38M": (8.0, 2.0)}
MEMORY = {"86k": (None, None), "1.38M": (640.0, 250.0)}
POLYGONS = {10: (12.0, 25.0), 1_000: (20.0, 25.0), 100_000: (15.0, 25.0)}
MB = 1e6

Task = tuple[str, Callable[[str], Iterable[Row]]]


def tasks(suite: Suite) -> Iterator[Task]:
    """Yield the rows of the table in its order."""
    quick = suite.options.quick
    sizes = SIZES[:1] if quick else SIZES
    made: dict[str, dict[str, Prepared]] = {}
    for size in sizes:
        yield f"uniform, {size} faces vs Open3D", partial(_polyhedron, suite, size, "uniform", made)
        yield f"near the surface, {size} faces vs Open3D", partial(_polyhedron, suite, size, "near", made)
    for place in ("uniform", "near"):
        yield f"cost of exactness, {place}", partial(_cost_of_exactness, suite, sizes[-2:][0], place)
    for size in () if quick else SIZES[1:]:
        yield f"build, {size} faces", partial(_build, suite, size)
    size = "1k" if quick else "86k"
    yield f"first answer, 1,000 points, {size} faces", partial(_first_answer, suite, size)
    for n_vertices in (10, 1_000) if quick else POLYGONS:
        for place in ("uniform", "near"):
            name = f"polygon, {n_vertices:,} vertices, {place} vs shapely"
            yield name, partial(_polygon, suite, n_vertices, place)
    for n_planes in (6, 20, 100):
        yield f"convex, {n_planes} planes vs numpy", partial(_convex, suite, n_planes)
    n_polygons, n_polyhedra = (1_000, 27) if quick else (10_000, 1_000)
    yield f"scene, {n_polygons:,} polygons vs STRtree", partial(_scene, suite, "polygons", n_polygons)
    yield f"scene, {n_polyhedra:,} polyhedra vs Open3D", partial(_scene, suite, "polyhedra", n_polyhedra)
    yield "hard set, wrong answers", partial(_hard, suite)


def _polyhedron(suite: Suite, size: str, place: str, made: dict[str, dict[str, Prepared]], name: str) -> Iterable[Row]:
    chosen = suite.options
    mesh = workloads.mesh_of_size(size, chosen.seed)
    draw = workloads.uniform_points if place == "uniform" else workloads.near_points
    goals = (UNIFORM if place == "uniform" else NEAR)[size]
    points = draw(mesh, chosen.n_points, chosen.seed)
    for other in set(made) - {size}:  # large structures, not needed again
        del made[other]
    kept = made.setdefault(size, {})
    for row in suite.against(name, "polyhedron", "open3d_occupancy", mesh, points, goals, kept):
        row.note = f"{mesh.name}, {row.note}"
        yield row


def _cost_of_exactness(suite: Suite, size: str, place: str, name: str) -> Iterable[Row]:
    """Our time over that of the same code with plain signs, on the same cells."""
    chosen = suite.options
    mesh = workloads.mesh_of_size(size, chosen.seed)
    draw = workloads.uniform_points if place == "uniform" else workloads.near_points
    points = draw(mesh, chosen.n_points, chosen.seed)
    ours = load("ours").MAKERS["polyhedron"](mesh, chosen.threads)
    settle(ours, points)
    plain = load("plain_signs").with_plain_signs(ours)
    (a, b), (exact, found) = interleaved(
        [lambda: plain.ask(points), lambda: ours.ask(points)], chosen.rounds, chosen.seconds
    )
    wall, cpu = ratios(a, b)
    row = Row(name, "times", 1.05, 1.0, wall.median, wall.low, wall.high, cpu.median)
    row.ours, row.peer = (f"{len(points) / t.median / 1e6:.3g} M/s" for t in (b, a))
    row.note = (
        f"{mesh.name}, {ours.method()}; plain signs answer {int((exact != found).sum())} of {len(points)} otherwise"
    )
    row.raw |= {"ours": asdict(b), "plain": asdict(a)}
    yield row


def _build(suite: Suite, size: str, name: str) -> Iterable[Row]:
    """The build is what the first large question costs more than the same question asked again."""
    chosen = suite.options
    mesh = workloads.mesh_of_size(size, chosen.seed)
    points = workloads.uniform_points(mesh, memory.points_that_pay(len(mesh.faces)), chosen.seed)
    seconds, checked, used = [], [], ""
    for _ in range(3):
        made_in, _, prepared = clocked(partial(load("ours").MAKERS["polyhedron"], mesh, chosen.threads))
        first, again = (clocked(partial(prepared.ask, points))[0] for _ in range(2))
        used = prepared.method()
        seconds.append(first - again)
        checked.append(made_in)
    row = of_seconds(Row(name, "s", *BUILD[size]), seconds)
    row.note = f"{used}; constructor, with its checks, {min(checked):.3g} s besides"
    row.raw["constructor"] = checked
    peers = [_build_of_peer(mesh, chosen.threads) for _ in range(3)]
    if None not in peers:
        row.peer = f"{sorted(peers)[1]:.3g} s"
        row.raw["peer"] = peers
    yield row
    found = memory.of_build("ours", size, chosen.seed, chosen.threads)
    peer = memory.of_build("open3d_occupancy", size, chosen.seed, chosen.threads)
    row = Row(f"{name}, memory", "MB", *MEMORY[size], raw={"ours": found, "peer": peer})
    if "error" in found:
        row.note = found["error"]
    else:
        row.value = found["peak"] / MB
        row.note = f"highest; kept {found['kept'] / MB:.0f} MB, of arrays {found['says'] / MB:.0f} MB"
    if "peak" in peer:
        row.peer = f"{peer['peak'] / MB:.0f} MB"
    yield row


def _build_of_peer(mesh: workloads.Mesh, threads: int) -> float | None:
    module = load("open3d_occupancy")
    return None if isinstance(module, Absent) else clocked(lambda: module.MAKERS["polyhedron"](mesh, threads))[0]


def _first_answer(suite: Suite, size: str, name: str) -> Iterable[Row]:
    mesh = workloads.mesh_of_size(size, suite.options.seed)
    points = workloads.uniform_points(mesh, 1_000, suite.options.seed)
    alone, whole = [], []
    for _ in range(2 + 7):
        made_in, _, solid = clocked(partial(engine.Polyhedron, mesh.vertices, mesh.faces))
        asked_in, _, _ = clocked(partial(engine.locate, points, solid, workers=suite.options.threads))
        alone.append(asked_in)
        whole.append(made_in + asked_in)
    row = of_seconds(Row(name, "s", 0.15, 0.05), whole[2:])
    row.note = f"{len(mesh.faces)} faces, from arrays; without the constructor {np.median(alone[2:]):.3g} s"
    row.raw["without_constructor"] = alone[2:]
    yield row


def _polygon(suite: Suite, n_vertices: int, place: str, name: str) -> Iterable[Row]:
    chosen = suite.options
    rings = workloads.star_polygon(n_vertices, chosen.seed)
    draw = workloads.uniform_points if place == "uniform" else workloads.near_points
    goals = POLYGONS[n_vertices] if place == "uniform" else (5.0, 10.0)
    points = draw(rings, chosen.n_points, chosen.seed)
    yield from suite.against(name, "polygon", "shapely_polygons", rings, points, goals)


def _convex(suite: Suite, n_planes: int, name: str) -> Iterable[Row]:
    chosen = suite.options
    planes = workloads.convex_planes(n_planes, chosen.seed)
    points = workloads.uniform_points(planes, chosen.n_points, chosen.seed)
    yield from suite.against(name, "convex", "numpy_planes", planes, points, (4.0, 8.0))


def _scene(suite: Suite, what: str, n_bodies: int, name: str) -> Iterable[Row]:
    """Two rows: everything made and asked for the first time, and asked again when all is prepared."""
    chosen = suite.options
    draw, peer_name, goals = {
        "polygons": (workloads.polygon_scene, "shapely_polygons", (3.0, 10.0)),
        "polyhedra": (workloads.polyhedron_scene, "open3d_occupancy", (5.0, 20.0)),
    }[what]
    bodies = draw(n_bodies, chosen.seed)
    points = workloads.uniform_points(bodies, chosen.n_points, chosen.seed)
    kind = f"scene_{what}"
    peer_module = load(peer_name)
    if not isinstance(peer_module, Absent):
        made = [clocked(lambda c=c: load(c).MAKERS[kind](bodies, chosen.threads)) for c in ("ours", peer_name)]
        asked = [prepared.native(points) for _, _, prepared in made]
        firsts = [clocked(lambda p=p, q=q: p.ask(q))[0] for (_, _, p), q in zip(made, asked, strict=True)]
        whole = [made_in + first for (made_in, _, _), first in zip(made, firsts, strict=True)]
        row = Row(f"{name}, first time", "x", None, None, whole[1] / whole[0])
        row.ours, row.peer = (f"{seconds:.3g} s" for seconds in whole)
        row.note = f"one run; made in {made[0][0]:.3g} s and {made[1][0]:.3g} s"
        yield row
        prepared = {"ours": made[0][2], peer_name: made[1][2]}
        yield from suite.against(f"{name}, prepared", kind, peer_name, bodies, points, goals, prepared)
    else:
        yield from suite.against(name, kind, peer_name, bodies, points, goals)


def _hard(suite: Suite, name: str) -> Iterable[Row]:
    """Every file twice: by the first question, and again when every structure is built."""
    totals = {"ours": [0, 0], "open3d_occupancy": [0, 0]}
    boundary = 0
    for path in workloads.hard_sets():
        case = np.load(path)
        mesh = workloads.Mesh(path.stem, case["vertices"], case["faces"].astype(np.int64))
        exact = case["location"]
        solid = engine.Polyhedron(mesh.vertices, mesh.faces)
        many = workloads.uniform_points(mesh, memory.points_that_pay(len(mesh.faces)), suite.options.seed)
        for is_prepared in (False, True):
            if is_prepared:
                engine.locate(many, solid, workers=suite.options.threads)
            found = engine.locate(case["points"], solid, workers=suite.options.threads)
            totals["ours"][0] += int((found != exact).sum())
            totals["ours"][1] += len(exact)
            boundary += int(((found == 0) != (exact == 0)).sum())
        module = load("open3d_occupancy")
        if not isinstance(module, Absent):
            peer = module.MAKERS["polyhedron"](mesh, suite.options.threads)
            held = peer.answer(peer.ask(peer.native(case["points"])))
            totals["open3d_occupancy"][0] += int((held != (exact >= 0)).sum())
            totals["open3d_occupancy"][1] += len(exact)
    wrong, n_points = totals["ours"]
    row = Row(name, "", 0.0, 0.0, float(wrong), raw=totals)
    row.ours = f"{wrong}/{n_points}"
    row.peer = "{}/{}".format(*totals["open3d_occupancy"])
    row.note = f"ours three-valued, before and after the build; boundary missed or invented {boundary}; peers in or out"
    yield row


def main(words: list[str] | None = None) -> int:
    """Run the suite; the exit code is 0 also where a row misses its goal: the table says so."""
    suite = Suite("containment", options(words, __doc__ or ""))
    suite.run(tasks(suite))
    return 0


if __name__ == "__main__":
    sys.exit(main())
