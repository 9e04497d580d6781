"""Who is wrong on your own data: ``python -m engine audit SUBJECT [ITEMS] [--question ...] [-o page.html]``.

Asks the textbook's methods, the same on numbers rounded to float32, and every peer that is installed about your points,
segments, bodies or layers; judges them by the exact engine; prints a table and writes one page that needs no other
file: who is wrong, how often, on which items, how fast. Of a mesh or polygon alone the points are the middles of its
own faces or edges, rounded: on its boundary, or beside it by less than a float32 shows.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import engine
from benchmarks import errors, machine, table, web_page
from benchmarks.bodies import Pair
from benchmarks.contenders import Placed, Prepared
from benchmarks.contest import Contender, Contest, Row, field_of, hold, refusing
from benchmarks.fields import collision as in_collision
from benchmarks.fields import containment as in_containment
from benchmarks.fields import overlay as in_overlay
from benchmarks.fields import segments as in_segments
from benchmarks.measure import interval
from benchmarks.web_page import percent
from benchmarks.workloads import Mesh, Rings, document
from engine.files.solids import from_json, read_solid, read_solids
from engine.files.tables import read_rows
from engine.textbook import methods

QUESTIONS = ("contains", "segments", "collide", "overlay")
MOST_STEPS = 2_000_000
"""Of a textbook's method for one item: about a second."""
MOST_NAMED = 1_000
"""Wrong items that are listed."""
MESHES, POLYGONS = ("open3d", "trimesh", "igl", "vtk", "cgal"), ("shapely", "matplotlib")
BODIES, LAYERS = (
    ("coal", "fcl", "open3d", "vtk", "igl", "manifold3d"),
    ("textbook", "shapely", "pyclipper", "manifold3d"),
)


ABOUT = "your bodies; most peers see surfaces only, and miss a body inside another"


def subject_of(solid: engine.Solid) -> Any:
    """Return a solid as contenders take it."""
    match solid:
        case engine.Polyhedron() | engine.Surface():
            return Mesh("yours", solid.vertices.copy(), solid.triangles.copy())  # some peers take writable arrays only
        case engine.Polygon():
            return Rings("yours", np.split(solid.vertices, solid.ring_offsets[1:-1]))
    return solid


def coarse(solid: engine.Solid) -> engine.Solid:
    """Return a solid whose numbers are rounded to float32."""

    def rounded(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: rounded(each) for key, each in value.items()}
        if isinstance(value, list):
            return [rounded(each) for each in value]
        return float(np.float32(value)) if isinstance(value, float) else value

    return from_json(rounded(document(subject_of(solid))))[0]


def books(of: Callable[..., methods.Methods], *solids: engine.Solid) -> Iterator[Contender]:
    """Yield the textbook's methods for some solids, and each in float32; none that takes seconds for an item."""
    for name in (name for name, (_, steps) in of(*solids).items() if steps <= MOST_STEPS):
        yield Contender(f"textbook: {name}", lambda name=name: Prepared(of(*solids)[name][0]))  # type: ignore[misc]

        def in_float32(name: str = name) -> Prepared:
            ask = of(*map(coarse, solids))[name][0]
            return Prepared(lambda *items: ask(*(each.astype(np.float32).astype(np.float64) for each in items)))

        yield Contender(f"textbook: {name}, float32", in_float32)


def telling(judge: Callable[[Any, Any], dict[str, Any]]) -> Callable[[Any, Any], dict[str, Any]]:
    """Return a judge that also lists the items that are wrong."""

    def told(answers: Any, exact: Any) -> dict[str, Any]:
        each = (item for item in range(len(exact)) if judge(answers[item : item + 1], exact[item : item + 1])["wrong"])
        found = judge(answers, exact)
        return found | {"where": [item for item, _ in zip(each, range(min(found["wrong"], MOST_NAMED)), strict=False)]}

    return told


def contains(solid: engine.Solid, points: np.ndarray) -> Contest:
    """Return the contest about points in a solid."""
    subject = subject_of(solid)
    peers = MESHES if isinstance(subject, Mesh) else POLYGONS if isinstance(subject, Rings) else ()
    asked = [*field_of("points", subject, peers, 1), *books(methods.of_points, solid)]
    exact = engine.contains(points, solid)
    return Contest("yours", "contains", True, points, exact, telling(errors.same), asked, "your points",
                   request=partial(in_containment.request, subject, points))  # fmt: skip


def own_points(solid: engine.Solid) -> np.ndarray:
    """Return the middles of a mesh's faces or a polygon's edges, rounded."""
    match subject_of(solid):
        case Mesh(vertices=vertices, faces=faces):
            return vertices[faces].mean(axis=1)
        case Rings(rings=rings):
            return np.concatenate([0.5 * ring + 0.5 * np.roll(ring, -1, axis=0) for ring in rings])
    raise ValueError("one file is a mesh or a polygon; to ask about other solids give points, segments or bodies, too")


def segments(region: engine.Solid, items: np.ndarray) -> Contest:
    """Return the contest about segments clipped on a region: kept or not, and the coordinates."""
    subject = subject_of(region)
    peers = ("shapely", "celltree") if isinstance(region, engine.Aabb) and region.dimension == 2 else ()
    asked = [*field_of("segments", subject, peers, 1), *books(methods.of_segments, region)]
    ours = asked[0].make()
    exact = ours.answer(ours.ask(items))
    judge = telling(errors.coordinates)
    return Contest("yours", "segments", True, items, exact, judge, asked, "your segments",
                   request=partial(in_segments.request, subject, items))  # fmt: skip


def collide(first: engine.Solid, second: engine.Solid, poses: np.ndarray | None) -> Contest:
    """Return the contest about two bodies, as they stand or under poses (n, 3, 4) of the second."""
    bodies = [subject_of(body) for body in (first, second)]
    if poses is None:
        is_met = engine.collide(first, second, boolean=True).relation != engine.Relation.DISJOINT
        couple = [Placed(body, is_closed=not isinstance(solid, engine.Surface))
                  for body, solid in zip(bodies, (first, second))]  # fmt: skip
        made = in_collision.on_couples("collide", True, [couple], np.array([is_met]), ABOUT, BODIES)
        own = [replace(each, make=partial(_for_one, each)) for each in books(methods.of_pairs, first, second)]
        return replace(made, operation="yours", contenders=[*made.contenders, *own], judge=telling(errors.same))
    is_closed = all(isinstance(solid, engine.Polyhedron) for solid in (first, second))
    pair = Pair("yours", bodies[0], bodies[1], is_closed, poses[:, :, :3], poses[:, :, 3])
    exact = engine.collide_poses(first, second, pair.rotations, pair.translations, boolean=True)
    rows, asked = np.arange(len(poses)), field_of("poses", pair, BODIES[:2], 1)
    met = np.asarray(exact) != engine.Relation.DISJOINT
    return Contest("yours", "collide", True, rows, met, telling(errors.same), asked, ABOUT,
                   request=partial(in_collision.request, pair))  # fmt: skip


def _for_one(contender: Contender) -> Prepared:
    ask = contender.make().ask
    return Prepared(lambda rows: np.array([int(refusing(lambda _: ask(), None)) for _ in rows]))


def overlay(subjects: Sequence[engine.Solid], clips: Sequence[engine.Solid]) -> Contest:
    """Return the contest about the areas of intersections, pair by pair; with one polygon on a side, that with all."""
    n = max(len(subjects), len(clips))
    if len({len(subjects), len(clips), 1, n}) > 2:
        raise ValueError(
            f"layers are asked pair by pair: {len(subjects)} and {len(clips)} polygons; make one of them 1"
        )
    sides = [
        [subject_of(solid).rings for solid in (side if len(side) == n else side * n)] for side in (subjects, clips)
    ]
    pairs = list(zip(*sides, strict=True))
    exact = np.array([in_overlay.by_ours(pair) for pair in pairs])
    asked = field_of("overlay", "intersection", LAYERS, 1)
    return Contest("yours", "overlay", True, pairs, exact, telling(errors.areas), asked, "your layers",
                   request=partial(in_overlay.request, pairs))  # fmt: skip


def contest_of(question: str | None, files: Sequence[str], poses: str | None) -> Contest:
    """Return the contest that the files are about; without a question the one that the second file tells."""
    first, second = files[0], files[-1]
    solids = read_solids(first)
    if len(files) == 1:
        return contains(solids[0], own_points(solids[0]))
    dimension = solids[0].dimension
    is_table = Path(second).suffix.lower() in (".npy", ".csv")
    if question is None and is_table:
        width = read_rows(second, (-1,)).shape[1]
        question = "contains" if width == dimension else "segments"
    elif question is None:
        question = "overlay" if dimension == 2 else "collide"
    if question == "overlay":
        return overlay(solids, read_solids(second))
    if question == "contains":
        return contains(solids[0], read_rows(second, (dimension,)))
    if question == "segments":
        return segments(solids[0], read_rows(second, (2, dimension)))
    rows = None if poses is None else read_rows(poses, (dimension, dimension + 1))
    return collide(solids[0], read_solid(second), rows)


def lines_of(rows: Sequence[Row]) -> Iterator[str]:
    """Yield a line a contender: speed, wrong answers with their 95% interval, refusals, the first items."""
    judged = max(row.errors.get("judged", 0) for row in rows)
    yield f"{'contender':<34}{'a second':>12}  {f'wrong of {judged:,}':<24}  items"
    for row in rows:
        if row.absent:
            yield f"{row.contender:<34}{'':>12}  absent: {row.absent}"
            continue
        wrong, where = row.errors["wrong"], row.errors["where"]
        between = " to ".join(map(percent, interval(wrong, row.errors["judged"])))
        silent = ", ".join(f"{row.errors[kind]:,} {kind}" for kind in ("refused", "outside") if row.errors.get(kind))
        items = ", ".join(map(str, where[:6])) + ", ..." * (wrong > 6)
        shown = "the judge" if row.contender == "ours" else "; ".join(filter(None, (silent, items)))
        yield f"{row.contender:<34}{row.rate:>12,.0f}  {f'{wrong:,} ({between})':<24}  {shown}".rstrip()


def main(words: Sequence[str] | None = None) -> int:
    """Ask, print and write the page."""
    parser = argparse.ArgumentParser("python -m engine audit", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("file", help="a solid or a layer")
    parser.add_argument("items", nargs="?", help="points, segments, a solid or a layer; else its own faces or edges")
    parser.add_argument("--question", choices=QUESTIONS, help="told by the files if left out")
    parser.add_argument("--poses", metavar="FILE", help="of the second body: rows [R | t], 12 numbers")
    parser.add_argument("--seconds", type=float, default=1.0, help="of each contender")
    parser.add_argument("-o", "--output", metavar="PAGE", help="an .html file; .json for the results alone")
    given = parser.parse_args(words)
    files = [given.file, *([given.items] if given.items else [])]
    contest = contest_of(given.question, files, given.poses)
    facts = machine.facts(0, machine.cores())
    rows = hold(contest, 3, given.seconds, has_latency=True)
    print("\n".join(lines_of(rows)))
    found = facts | {"load_after": machine.load(), "seconds": given.seconds, "quick": False}
    found["rows"] = [asdict(row) | {"rate": row.rate, "net_rate": row.net_rate} for row in rows]
    if given.output and given.output.endswith(".json"):
        Path(given.output).write_text(json.dumps(found, default=table.plain))
    elif given.output:
        title = " and ".join(Path(name).name for name in files)
        asked = ((title, "yours", "", contest.name),)
        Path(given.output).write_text(web_page.text_of(found, "this page", asked), "utf-8")
    return 0
