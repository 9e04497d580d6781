"""The command line: ``python -m engine contains | collide | clip | overlay | bounds``, for people who have files.

``python -m engine warm`` compiles all kernels before they are needed, here or for other machines (``--into``).

A solid is a mesh file, an .npz of `vertices` and `faces`, a .json or .geojson file, or the JSON of a solid itself, as
in ``'{"type": "sphere", "center": [0, 0, 0], "radius": 1}'``. Points, segments and poses come from .npy, .csv or
.geojson. Answers go to the standard output as .csv or GeoJSON, or to the file named by --output, in the format that its
name tells. Exit code: 0, or 2 where the input is at fault (the message says how).
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

import numpy as np

from engine.collision.collide_poses import collide_poses
from engine.containment.locate import locate
from engine.errors import EngineError, InvalidInputError
from engine.files.solids import read_solid, read_solids
from engine.files.tables import read_rows, write_geojson, write_table
from engine.kernel_cache import cache_folder, seal
from engine.parallel import Progress
from engine.polygon_clipping.clip_polygons import PolygonStatus, clip_polygons
from engine.polygon_overlay.batch import overlay_batch
from engine.polygon_overlay.result import Output
from engine.polygon_overlay.run import Operation
from engine.segment_clipping.clip_segments import clip_segments
from engine.solids.bounds import bounds
from engine.types import Location, Relation
from engine.version import __version__
from engine.warmup import warm

Options = argparse.Namespace


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    options = _parser().parse_args(arguments)
    run: Callable[[Options], None] = options.run
    try:
        run(options)
    except EngineError as error:
        place = ".".join(map(str, error.where))
        return _refused(f"{error.code}{f' at {place}' if place else ''}: {error.message}")
    except BrokenPipeError:  # the reader of our output has seen enough
        sys.stderr.close()
        return 0
    except (OSError, ValueError) as error:
        return _refused(str(error))
    return 0


def _refused(message: str) -> int:
    print(f"error: {message}", file=sys.stderr)
    return 2


def _contains(options: Options) -> None:
    solid = read_solid(options.solid)
    points = read_rows(options.points, (solid.dimension,))
    with _bar(len(points), "points", options) as progress:
        answer = locate(points, solid, progress=progress, deadline=options.deadline)
    if options.output is None or options.output.endswith(".csv"):
        labels = np.array([Location(value).name.lower() for value in (-1, 0, 1)])
        write_table(options.output, {"location": labels[answer + 1]})
    else:
        write_table(options.output, {"location": answer})


def _collide(options: Options) -> None:
    first, second = read_solid(options.first), read_solid(options.second)
    size = first.dimension
    if options.poses is None:
        rows = np.eye(size, size + 1)[np.newaxis]
    else:
        rows = read_rows(options.poses, (size, size + 1))
    with _bar(len(rows), "poses", options) as progress:
        answer: Any = collide_poses(
            first, second, rows[:, :, :size], rows[:, :, size], progress=progress, deadline=options.deadline
        )
    if options.output is None or options.output.endswith(".csv"):
        write_table(options.output, {"relation": np.array([each.label for each in Relation])[answer]})
    else:
        write_table(options.output, {"relation": answer})


def _clip(options: Options) -> None:
    region = read_solid(options.region)
    if options.polygons:
        _clip_polygons(region, options)
        return
    segments = read_rows(options.items, (2, region.dimension))
    with _bar(len(segments), "segments", options) as progress:
        pieces = clip_segments(segments, region, progress=progress, deadline=options.deadline)
    names = ("source", "start", "end", "t", "faces")
    write_table(options.output, {name: getattr(pieces, name) for name in names})


def _clip_polygons(region: Any, options: Options) -> None:
    polygons = read_solids(options.items)
    with _bar(len(polygons), "polygons", options) as progress:
        clipped = clip_polygons(polygons, region, progress=progress, deadline=options.deadline)  # type: ignore[arg-type]
    if clipped.status.any():
        item = int(np.argmax(clipped.status != 0))
        raise InvalidInputError(
            f"polygon {item} has status {PolygonStatus(clipped.status[item]).name}", ("items", item)
        )
    write_geojson(options.output, [[clipped.rings(item)] for item in range(len(polygons))])


def _overlay(options: Options) -> None:
    subjects, clips = read_solids(options.subject), read_solids(options.clip)
    with _bar(len(subjects), "pairs", options) as progress:
        batch: Any = overlay_batch(
            subjects, clips, options.operation, output=options.rounding, progress=progress, deadline=options.deadline
        )
    pieces = [[] if each is None else each.pieces for each in batch]
    write_geojson(options.output, [[[piece.shell, *piece.holes] for piece in item] for item in pieces])


def _bounds(options: Options) -> None:
    found = bounds(read_solid(options.solid), deadline=options.deadline)
    radius = np.array([found.sphere.radius])
    row = {"min": found.aabb.min, "max": found.aabb.max, "center": found.sphere.center, "radius": radius}
    write_table(options.output, {name: value[np.newaxis] for name, value in row.items()})


def _warm(options: Options) -> None:
    if options.cpu or options.into:
        _warm_elsewhere(options)
        return
    with _bar(100, "%", options) as progress:
        warm(progress or (None if options.quiet else _Lines()), processes=options.processes)
    if not options.quiet:
        print(f"every kernel is in {cache_folder()}", file=sys.stderr)


def _warm_elsewhere(options: Options) -> None:
    """Run the command again, where the compiler finds another CPU and another folder: it looks for them but once."""
    command = [sys.executable, "-P", "-m", "engine", "warm", "--processes", str(options.processes)]
    surroundings = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    if options.cpu:
        surroundings |= {"NUMBA_CPU_NAME": options.cpu, "NUMBA_CPU_FEATURES": ""}
    with TemporaryDirectory() as temporary:
        archive = Path(options.into) if options.into and options.into.endswith(".tar.xz") else None
        folder = Path(options.into) if options.into and archive is None else Path(temporary)
        if options.into:
            (archive.parent if archive else folder).mkdir(parents=True, exist_ok=True)
            surroundings["ENGINE_CACHE_DIR"] = str(folder.resolve())
            surroundings.pop("ENGINE_CACHE_SEED", None)
        if subprocess.run([*command, *["--quiet"] * options.quiet], env=surroundings, check=False).returncode:
            raise ValueError("not every kernel was compiled")
        if options.into:
            seal(folder, archive)


class _Lines:
    """Says in lines how much is done, where there is no bar."""

    def __init__(self) -> None:
        self._done = 0

    def __call__(self, share: int) -> None:
        self._done += share
        print(f"kernels: {self._done} %", file=sys.stderr)


@contextmanager
def _bar(n_items: int, unit: str, options: Options) -> Iterator[Progress | None]:
    """Show a progress bar where someone looks at the standard error and tqdm is installed."""
    if options.quiet or not sys.stderr.isatty():
        yield None
        return
    try:
        from tqdm import tqdm
    except ImportError:
        yield None
        return
    with tqdm(total=n_items, unit=f" {unit}", unit_scale=True, leave=False) as bar:
        yield bar.update


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m engine", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="version", version=f"exact-geometry {__version__}")
    commands = parser.add_subparsers(required=True, metavar="command")
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("-o", "--output", metavar="FILE", help="where the answer goes; the standard output by default")
    common.add_argument("-q", "--quiet", action="store_true", help="no progress bar")
    common.add_argument("--deadline", type=float, metavar="SECONDS", help="give up after so long")
    command = partial(commands.add_parser, parents=[common])

    contains = command("contains", help="locate points in a solid: inside, boundary or outside")
    contains.add_argument("solid", help="see above")
    contains.add_argument("points", help="rows of 2 or 3 coordinates")
    contains.set_defaults(run=_contains)

    collide = command("collide", help="tell how two solids lie to each other, under one or many poses of the second")
    collide.add_argument("first")
    collide.add_argument("second")
    collide.add_argument(
        "--poses", metavar="FILE", help="rows [R | t] of the second: 12 numbers in space, 6 in the plane"
    )
    collide.set_defaults(run=_collide)

    clip = command("clip", help="clip segments on a solid, or polygons on a convex one")
    clip.add_argument("region")
    clip.add_argument("items", help="rows of two positions; with --polygons a .geojson file")
    clip.add_argument("--polygons", action="store_true", help="Sutherland-Hodgman on the polygons of a .geojson file")
    clip.set_defaults(run=_clip)

    overlay = command("overlay", help="Boolean operation on polygons, pair by pair")
    overlay.add_argument("subject", help=".geojson file")
    overlay.add_argument("clip", help=".geojson file with as many polygons")
    overlay.add_argument("--operation", choices=get_args(Operation), default="intersection")
    overlay.add_argument("--rounding", choices=get_args(Output), default="valid")
    overlay.set_defaults(run=_overlay)

    box = command("bounds", help="smallest box and smallest sphere of a solid")
    box.add_argument("solid")
    box.set_defaults(run=_bounds)

    ready = commands.add_parser("warm", help="compile all kernels now, for this machine or to ship them")
    ready.add_argument("--into", metavar="FOLDER", help="a folder or .tar.xz for ENGINE_CACHE_SEED of other machines")
    ready.add_argument("--cpu", metavar="NAME", help="the oldest CPUs to run on: x86-64-v3; this one by default")
    ready.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N", help="one a core by default")
    ready.add_argument("-q", "--quiet", action="store_true", help="no progress bar")
    ready.set_defaults(run=_warm)
    return parser


if __name__ == "__main__":
    sys.exit(main())
