"""The command line ``python -m engine contains | collide | clearance | distances | clip | hits | bounds | volume |
section | cut | overlay | union | join | crop | relate | nearest | split``: for files; the last seven are for layers.

``python -m engine warm`` compiles all kernels before they are needed, here or for other machines (``--into``);
``python -m engine audit`` compares other packages with the exact answers on your data.

A solid is a mesh file, an .npz of `vertices` and `faces`, a .json or .geojson file, or the JSON of a solid itself, as
in ``'{"type": "sphere", "center": [0, 0, 0], "radius": 1}'``. Points, segments and poses come from .npy, .csv or
.geojson. Answers go to the standard output as .csv or GeoJSON, or to the file named by --output, in the format of its
extension. Exit code: 0, or 2 if the input is invalid (the message says how).
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from engine.collision.collide_poses import collide_poses
from engine.containment.locate import locate
from engine.distance.clearance import clearance_poses
from engine.distance.distances import Distances, distances
from engine.errors import EngineError, InvalidInputError
from engine.files.layers import SEQUENCES, feature_in, write_geojson, write_layer
from engine.files.octets import in_words
from engine.files.solids import read_features, read_rows, read_solid, read_solids, write_mesh, write_table
from engine.layers.feature_joins import join_features, locate_features, nearest_features
from engine.layers.features import clip_features, dissolve_features, overlay_features, split_features
from engine.layers.relate import PREDICATES
from engine.layers.rows import HOWS
from engine.layers.streams import FeatureStream
from engine.polygon_clipping.clip_polygons import PolygonStatus, clip_polygons
from engine.segment_clipping.clip_segments import clip_segments
from engine.segment_clipping.hits import HitKind, hits
from engine.solid_cutting.cut import cut
from engine.solid_cutting.measures import area, centroid, volume
from engine.solid_cutting.section import section
from engine.solids.bounds import bounds
from engine.types import Location, Relation
from engine.version import __version__
from engine.warm_command import Options, progress_bar, warm_kernels
from engine.warmup import OPERATIONS, warm


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command of the command line and return its exit code."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    try:
        if words[:1] == ["audit"]:
            return _audit(words[1:])
        options = _parser().parse_args(words)
        run: Callable[[Options], None] = options.run
        run(options)
    except EngineError as error:
        place = ".".join(map(str, error.where))
        return _refused(f"{error.code}{f' at {place}' if place else ''}: {error.message}")
    except BrokenPipeError:  # the reader of our output has seen enough
        sys.stderr.close()
        return 0
    except OSError as error:
        return _refused(f"{error.filename}: {in_words(error)}" if error.filename else str(error))
    except ValueError as error:
        return _refused(str(error))
    return 0


def _refused(message: str) -> int:
    print(f"error: {message}", file=sys.stderr)
    return 2


def _note(options: Options) -> Callable[[str], None] | None:
    """Return a function that prints what was skipped in a file; None with --quiet."""
    return None if options.quiet else partial(print, file=sys.stderr)


def _contains(options: Options) -> None:
    solid = read_solid(options.solid, _note(options))
    points = read_rows(options.points, (solid.dimension,))
    with progress_bar(len(points), "points", options) as progress:
        answer = locate(points, solid, progress=progress, deadline=options.deadline)
    _write_labels(options, "location", [Location(code).name.lower() for code in (0, 1, -1)], answer)


def _write_labels(options: Options, name: str, labels: list[str], codes: Any) -> None:
    """Write integer codes to the output, as labels[code] where it is .csv."""
    is_text = options.output is None or options.output.endswith(".csv")
    write_table(options.output, {name: np.array(labels)[codes] if is_text else codes})


def _posed_pair(options: Options) -> tuple[Any, ...]:
    """Return (first solid, second solid, rotations, translations of the second); the identity without --poses."""
    first, second = read_solid(options.first, _note(options)), read_solid(options.second, _note(options))
    size = first.dimension
    rows = np.eye(size, size + 1)[np.newaxis] if options.poses is None else read_rows(options.poses, (size, size + 1))
    return first, second, rows[:, :, :size], rows[:, :, size]


def _collide(options: Options) -> None:
    pair = _posed_pair(options)
    with progress_bar(len(pair[2]), "poses", options) as progress:
        answer: Any = collide_poses(*pair, progress=progress, deadline=options.deadline)
    _write_labels(options, "relation", [each.label for each in Relation], answer)


def _clearance(options: Options) -> None:
    pair = _posed_pair(options)
    with progress_bar(len(pair[2]), "poses", options) as progress:
        answer: Any = clearance_poses(*pair, at_least=options.at_least, progress=progress, deadline=options.deadline)
    write_table(options.output, {"distance" if options.at_least is None else "clear": answer})


def _distances(options: Options) -> None:
    solid = read_solid(options.solid, _note(options))
    points = read_rows(options.points, (solid.dimension,))
    asked: Any = {"to": "boundary" if options.boundary else "solid", "signed": options.signed, "within": options.within}
    with progress_bar(len(points), "points", options) as progress:
        answer: Any = distances(
            points, solid, **asked, nearest=options.nearest, progress=progress, deadline=options.deadline
        )
    if isinstance(answer, Distances):
        names = ("distance", "point", "face", "kind", "index")
        write_table(options.output, {name: getattr(answer, name) for name in names})
    else:
        write_table(options.output, {"distance" if options.within is None else "within": answer})


def _clip(options: Options) -> None:
    region = read_solid(options.region, _note(options))
    if options.polygons:
        _clip_polygons(region, options)
        return
    segments = read_rows(options.items, (2, region.dimension))
    with progress_bar(len(segments), "segments", options) as progress:
        pieces = clip_segments(segments, region, progress=progress, deadline=options.deadline)
    names = ("source", "start", "end", "t", "faces")
    write_table(options.output, {name: getattr(pieces, name) for name in names})


def _hits(options: Options) -> None:
    surface = read_solid(options.surface, _note(options))
    lines = read_rows(options.items, (2, 3))
    with progress_bar(len(lines), "lines", options) as progress:
        answer: Any = hits(
            lines, surface, rays=options.rays, keep=options.keep, progress=progress, deadline=options.deadline
        )
    if options.keep == "any":
        write_table(options.output, {"met": answer})
        return
    columns = {name: getattr(answer, name) for name in type(answer).__slots__}
    if options.output is None or options.output.endswith(".csv"):
        columns["kind"] = np.array([kind.name.lower() for kind in HitKind])[answer.kind]
    write_table(options.output, columns)


def _clip_polygons(region: Any, options: Options) -> None:
    polygons = read_solids(options.items, _note(options))
    with progress_bar(len(polygons), "polygons", options) as progress:
        clipped = clip_polygons(polygons, region, progress=progress, deadline=options.deadline)
    if clipped.status.any():
        item = int(np.argmax(clipped.status != 0))
        raise InvalidInputError(
            f"polygon {item} has status {PolygonStatus(clipped.status[item]).name}", ("items", item)
        )
    write_geojson(options.output, (_clipped(clipped.rings(item), item) for item in range(len(polygons))))


def _clipped(rings: Any, item: int) -> dict[str, Any]:
    """Return a clipped polygon as a GeoJSON feature with all its rings, which may have bridges."""
    closed = [[*ring.tolist(), ring[0].tolist()] for ring in rings]
    geometry = {"type": "MultiPolygon", "coordinates": [closed]}
    return {"type": "Feature", "properties": {"item": item}, "geometry": geometry}


def _overlay(options: Options) -> None:
    left, right = read_features(options.left), read_features(options.right)
    more = _of_areas(options)
    _write_features(overlay_features(left, right, options.operation, **more), options)


def _union(options: Options) -> None:
    more = {"coverage": options.coverage, "gaps": options.gaps, **_of_areas(options)}
    _write_features(dissolve_features(read_features(options.layer), options.by, **more), options)


def _crop(options: Options) -> None:
    if _stream(options, "clip", options.layer, options.mask, keep=options.keep, grid=options.grid, wrap=options.wrap):
        return
    layer, mask = read_features(options.layer), read_features(options.mask)
    _write_features(clip_features(layer, mask, keep=options.keep, **_of_areas(options)), options)


def _of_areas(options: Options) -> dict[str, Any]:
    names = "grid", "min_width", "wrap", "deadline"
    return {name: getattr(options, name) for name in names}


def _split(options: Options) -> None:
    layer, lines = read_features(options.layer), read_features(options.lines)
    _write_features(split_features(layer, lines, min_width=options.min_width, deadline=options.deadline), options)


def _nearest(options: Options) -> None:
    left, right = read_features(options.left), read_features(options.right)
    more = {name: getattr(options, name) for name in ("max_distance", "exclusive", "outside", "deadline")}
    _write_features(nearest_features(left, right, **more), options)


def _relate(options: Options) -> None:
    asked = {name: getattr(options, name) for name in ("predicate", "distance", "outside")}
    if _stream(options, "join", options.left, options.right, **asked):
        return
    left, right = read_features(options.left), read_features(options.right)
    more = {"distance": options.distance, "outside": options.outside, "deadline": options.deadline}
    _write_features(join_features(left, right, options.predicate, **more), options)


def _join(options: Options) -> None:
    points, polygons = read_features(options.points), read_features(options.polygons)
    _write_features(locate_features(points, polygons, outside=options.outside, deadline=options.deadline), options)


def _stream(options: Options, operation: str, source: str, layer: str, **more: Any) -> bool:
    """Answer the features of a file with one a line part by part into such a file; return whether both are."""
    if not (source.endswith(SEQUENCES) and str(options.output or "").endswith(SEQUENCES)):
        return False
    stream = FeatureStream(operation, read_features(layer), deadline=options.deadline, **more)

    def rows() -> Iterator[dict[str, Any]]:
        with Path(source).open(encoding="utf-8") as file:
            lines = ((number, line.strip().removeprefix("\x1e")) for number, line in enumerate(file, 1))
            features = (feature_in(number, line, source) for number, line in lines if line)
            while some := [*islice(features, _PART)]:
                yield from stream.rows(some, options.deadline)

    write_layer(options.output, rows(), None)
    return True


def _write_features(rows: Any, options: Options) -> None:
    write_layer(options.output, rows, rows.crs)
    for row, piece, width in rows.slivers or ():
        print(f"feature {row}, piece {piece}: {width!r} wide", file=sys.stderr)
    if rows.collapsed and not options.quiet:
        print(f"rounding left nothing of {rows.collapsed} rows", file=sys.stderr)


def _bounds(options: Options) -> None:
    volumes = bounds(read_solid(options.solid, _note(options)), deadline=options.deadline)
    radius = np.array([volumes.sphere.radius])
    row = {"min": volumes.aabb.min, "max": volumes.aabb.max, "center": volumes.sphere.center, "radius": radius}
    write_table(options.output, {name: value[np.newaxis] for name, value in row.items()})


def _volume(options: Options) -> None:
    solid = read_solid(options.solid, _note(options))
    asked: Any = {"volume": volume, "area": area, "centroid": centroid} if solid.dimension == 3 else {
        "area": area, "centroid": centroid}  # fmt: skip
    row = {name: np.atleast_1d(ask(solid, deadline=options.deadline)) for name, ask in asked.items()}
    write_table(options.output, {name: value[np.newaxis] for name, value in row.items()})


def _section(options: Options) -> None:
    solid = read_solid(options.solid, _note(options))
    with progress_bar(len(options.heights), "planes", options) as progress:
        made: Any = section(solid, options.heights, normal=options.normal, progress=progress, deadline=options.deadline)
    rings = np.repeat(np.arange(len(made.ring_offsets) - 1), np.diff(made.ring_offsets))
    pieces = np.repeat(np.arange(len(made.piece_offsets) - 1), np.diff(made.piece_offsets))[rings]
    planes = np.repeat(np.arange(len(made)), np.diff(made.plane_offsets))[pieces]
    write_table(options.output, {"plane": planes, "piece": pieces, "ring": rings, "position": made.vertices})


def _cut(options: Options) -> None:
    solid, region = (read_solid(each, _note(options)) for each in (options.solid, options.region))
    made = cut(solid, region, keep=options.keep, deadline=options.deadline)
    write_mesh(options.output, made.vertices, made.faces)
    if made.n_collapsed + made.n_folded and not options.quiet:
        print(f"rounding made {made.n_collapsed} faces flat and turned {made.n_folded} over", file=sys.stderr)


def _audit(words: Sequence[str]) -> int:
    """Run `benchmarks.audit`, which a wheel has too, and return its exit code."""
    audit = import_module(f"{warm.__module__.removesuffix('engine.warmup')}benchmarks.audit")
    return int((audit.main if "--asked" in words else audit.watched)(words))


_PART: Final = 2_000
"""Features of a stream in memory at a time."""
FORMATS: Final = "mesh file (.stl, .obj, .ply, .off, .glb), .npz, .json, .geojson, or the JSON of a solid"
SOLID: Final = {"solid": FORMATS}
POSES: Final = "file with rows [R | t], the poses of the second: 12 numbers in 3D, 6 in 2D; the identity by default"
PAIR: Final = {"first": FORMATS, "second": FORMATS, "--poses": POSES}
LAYER: Final = "layer of polygons: .geojson, or what geopandas reads (extra geo)"
ANY: Final = LAYER.replace("polygons", "points, lines and polygons")
ATTRIBUTES: Final = "; properties and ids are copied"
ROWS: Final = ".npy, .csv or .geojson file with rows of "
COMMANDS: Final[dict[str, tuple[Callable[[Options], None], str, Mapping[str, str | None]]]] = {
    "contains": (_contains, "locate points in a solid: inside, boundary or outside",
                 SOLID | {"points": ROWS + "2 or 3 coordinates"}),
    "collide": (_collide, "decide how two solids relate, for one or many poses of the second", PAIR),
    "clearance": (_clearance, "compute the distance of two solids, for one or many poses of the second", PAIR),
    "distances": (_distances, "compute how far points are from a solid",
                  SOLID | {"points": ROWS + "2 or 3 coordinates"}),
    "clip": (_clip, "clip segments to a solid, or polygons to a convex one",
             {"region": FORMATS, "items": ROWS + "two positions; with --polygons a .geojson file"}),
    "hits": (_hits, "find where segments or rays meet a mesh, with face, normal and barycentrics",
             {"surface": FORMATS, "items": ROWS + "two positions; with --rays origin and direction"}),
    "overlay": (_overlay, "Boolean operation on two layers, every feature with every one that it meets",
                {"left": LAYER + ATTRIBUTES, "right": LAYER}),
    "union": (_union, "unite the features of a layer, all or those with equal properties", {"layer": ANY}),
    "join": (_join, "join points to the features that contain them, boundary included",
             {"points": ".geojson file of points" + ATTRIBUTES, "polygons": LAYER}),
    "crop": (_crop, "cut the features of a layer to the union of some polygons",
             {"layer": ANY + ATTRIBUTES, "mask": LAYER}),
    "relate": (_relate, "join the features of two layers that have a relation: they meet, one is within the other, ...",
               {"left": ANY + ATTRIBUTES, "right": ANY}),
    "nearest": (_nearest, "join the features of a layer to the nearest ones of another, with the distance",
                {"left": ANY + ATTRIBUTES, "right": ANY}),
    "split": (_split, "split polygons by lines, a feature for each piece",
              {"layer": LAYER + ATTRIBUTES, "lines": LAYER.replace("polygons", "lines")}),
    "bounds": (_bounds, "smallest box and smallest sphere of a solid", SOLID),
    "volume": (_volume, "volume, area and centroid of a solid", SOLID),
    "section": (_section, "sections of a mesh at heights, as rows of plane, piece, ring and position", SOLID),
    "cut": (_cut, "what a half-space or a box leaves of a mesh, closed: .off, or .npz of vertices and faces",
            SOLID | {"region": FORMATS}),
}  # fmt: skip
"""By command: function, help text and arguments."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m engine", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="version", version=f"exact-geometry {__version__}")
    commands = parser.add_subparsers(required=True, metavar="command")
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("-o", "--output", metavar="FILE", help="output file; the standard output by default")
    common.add_argument("-q", "--quiet", action="store_true", help="no progress bar")
    common.add_argument("--deadline", type=float, metavar="SECONDS", help="time limit")
    command = partial(commands.add_parser, parents=[common])

    made = {}
    for name, (run, about, places) in COMMANDS.items():
        made[name] = command(name, help=about)
        made[name].set_defaults(run=run)
        for place, words in places.items():
            made[name].add_argument(place, help=words)
    made["clearance"].add_argument(
        "--at-least", type=float, metavar="DISTANCE", help="decide only: at least so far apart?"
    )
    made["distances"].add_argument("--boundary", action="store_true", help="from the boundary, inside too")
    made["distances"].add_argument("--signed", action="store_true", help="from the boundary, negative inside")
    made["distances"].add_argument("--within", type=float, metavar="DISTANCE", help="decide only: at most so far away?")
    made["distances"].add_argument("--nearest", action="store_true", help="the nearest points too, and their faces")
    made["clip"].add_argument("--polygons", action="store_true", help="clip polygons of .geojson (Sutherland-Hodgman)")
    made["section"].add_argument("heights", nargs="+", type=float, help="the planes dot(normal, p) = height")
    made["section"].add_argument("--normal", nargs=3, type=float, metavar="NUMBER", help="z by default")
    made["cut"].add_argument("--keep", choices=("inside", "outside"), default="inside")
    made["hits"].add_argument("--rays", action="store_true", help="half-lines: origin and direction")
    made["hits"].add_argument("--keep", choices=("all", "first", "any"), default="all")
    made["overlay"].add_argument("--operation", choices=HOWS, default="intersection")
    for name in ("overlay", "union", "crop"):
        made[name].add_argument("--grid", type=float, metavar="SPACING", help="snap polygons to multiples of this")
        made[name].add_argument(
            "--wrap", type=float, metavar="180", help="cut polygons at the antimeridian, join after"
        )
    for name in ("overlay", "union", "crop", "split"):
        made[name].add_argument("--min-width", type=float, metavar="DISTANCE", help="list pieces that are narrower")
    made["union"].add_argument("--gaps", choices=("keep", "refuse"), default="keep", help="with --coverage")
    made["crop"].add_argument("--keep", choices=("inside", "outside"), default="inside")
    made["nearest"].add_argument("--max-distance", type=float, metavar="DISTANCE", help="the largest, which counts")
    made["nearest"].add_argument("--exclusive", action="store_true", help="equal features are not the nearest")
    made["nearest"].add_argument("--outside", action="store_true", help="also write features without one so near")
    made["union"].add_argument("--coverage", action="store_true", help="refuse polygons that overlap")
    made["relate"].add_argument("--predicate", choices=(*PREDICATES, "dwithin"), default="intersects")
    made["relate"].add_argument("--distance", type=float, help="with dwithin: the largest distance")
    made["relate"].add_argument("--outside", action="store_true", help="also write features without such a relation")
    made["union"].add_argument("--by", nargs="+", metavar="NAME", help="unite features that agree in these properties")
    made["join"].add_argument("--outside", action="store_true", help="also write points that no feature contains")
    commands.add_parser("audit", help="compare libraries on your own data, on one page")
    ready = commands.add_parser("warm", help="compile all kernels now, for this machine or to ship them")
    ready.add_argument("operations", nargs="*", metavar="operation", help=f"{', '.join(OPERATIONS)}; all by default")
    ready.add_argument("--into", metavar="FOLDER", help="a folder or .tar.xz for ENGINE_CACHE_SEED of other machines")
    ready.add_argument("--cpu", metavar="NAME", help="the oldest CPUs to run on: x86-64-v3; this one by default")
    ready.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N", help="one a core by default")
    ready.add_argument("-q", "--quiet", action="store_true", help="no progress bar")
    ready.set_defaults(run=warm_kernels)
    return parser


if __name__ == "__main__":
    sys.exit(main())
