"""Compiles or loads every kernel that the public functions reach, by a small call of each.

Later calls of the public functions have the same argument types, so that nothing is compiled while a client waits; a
test compares the kernels reached here with those the engine has.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from engine.bounding.trees import build_bvh
from engine.collision.collide import collide
from engine.collision.collide_poses import collide_poses
from engine.collision.meshes.dual_traversal import SEEK_OVERLAP
from engine.collision.meshes.mesh_arrays import STILL, mesh_body_of
from engine.collision.meshes.mesh_pair import relate
from engine.collision.result import Work
from engine.collision.triangles import collide_triangles
from engine.compiling.cold_start import fill_cache, is_full, note_full
from engine.compiling.kernel_cache import expect_compiling, warn_of_compiling
from engine.containment.locate import locate
from engine.containment.methods.rational_locate import rational_location
from engine.containment.posed_locators import posed_locator
from engine.distance.clearance import clearance, clearance_poses
from engine.distance.distances import distances
from engine.errors import InvalidInputError
from engine.layers.geojson import EVERY, collection_of, mixed_of
from engine.layers.joins import nearest_of, related_pairs
from engine.layers.limits import Limits
from engine.polygon_clipping.clip_polygons import clip_polygons
from engine.polygon_clipping.planes import orientations
from engine.polygon_overlay.batch import overlay_batch
from engine.polygon_overlay.overlay import overlay, union_all
from engine.running.budget import Budget
from engine.running.parallel import check_options
from engine.scenes.collide_scene import collide_scene
from engine.scenes.point_queries import locate_scene
from engine.scenes.scene import Scene
from engine.segment_clipping.clip_segments import clip_segments
from engine.segment_clipping.hits import hits
from engine.segment_clipping.lines import clip_lines
from engine.solid_cutting.cut import cut
from engine.solid_cutting.measures import area, centroid, volume
from engine.solid_cutting.overlap import iou, overlap_volume
from engine.solid_cutting.section import section
from engine.solids.base import Solid
from engine.solids.bounds import bounds
from engine.solids.checks import as_points, shown
from engine.solids.implicit import Implicit
from engine.solids.mesh import Polyhedron, Surface
from engine.solids.polygon import Polygon
from engine.solids.pose import Pose
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle

_MANY = 50_000  # points: some milliseconds of work, and above what makes cells pay for solids this small

_done: set[int] = set()
"""Indices of the `STEPS` that were called."""
_lock = threading.Lock()


def warm(
    progress: Callable[[int], object] | None = None, *, processes: int = 1, operations: Iterable[str] | None = None
) -> None:
    """Compile or load every kernel, or those of some operations; a second call returns at once.

    Parameters
    ----------
    progress : callable, optional
        Called with hundredths of all the work as they are done, 100 in the end: ``tqdm(total=100).update`` fits.
    processes : int, default 1
        Where nothing is cached, up to so many more processes are started that compile (up to 1 GB each), and end.
    operations : iterable of str, optional
        Of which operations, by the names of their functions: ``["overlay", "locate"]``; all by default.

    Raises
    ------
    InvalidInputError
        For options of a wrong type, and for an operation that is not known.

    Notes
    -----
    Takes some minutes where nothing is cached, else a second or two; what is compiled is logged. Safe to call from
    several threads (the others wait) and processes (each compiles what it does not find). A wheel with kernels for this
    Python and numba, or ``ENGINE_CACHE_SEED``, needs no compiling.

    Examples
    --------
    >>> import engine
    >>> engine.warm(processes=2, operations=["overlay"])  # doctest: +SKIP
    """
    check_options(None, progress)
    if isinstance(processes, bool) or not isinstance(processes, int) or processes < 1:
        raise InvalidInputError(f"processes must be a whole number from 1, got {shown(processes)}", ("processes",))
    chosen = [*range(len(STEPS))] if operations is None else _steps_of(operations)
    with _lock:
        if _done.issuperset(chosen):
            return
        total = sum(SHARES[index] for index in chosen)
        if progress is not None:
            expect_compiling()
        elif not is_full(__name__):
            warn_of_compiling(__name__, processes * sum(SHARES) / total)
        ended = 0

        def report(share: int) -> None:
            nonlocal ended
            before, ended = 100 * ended // total, ended + share
            if progress is not None:
                progress(100 * ended // total - before)

        filled = fill_cache(__name__, SHARES, processes, report, chosen, RELATED if processes < len(RELATED) else None)
        for index in chosen:
            STEPS[index]()
            if index not in filled:
                report(SHARES[index])
        _done.update(chosen)
        if len(_done) == len(STEPS):
            note_full(__name__)


def _steps_of(operations: Iterable[str]) -> list[int]:
    """Return the indices of the steps for operations; raise InvalidInputError for other words."""
    chosen = set()
    for operation in operations if isinstance(operations, Iterable) else [operations]:
        if not isinstance(operation, str) or operation not in OPERATIONS:
            raise InvalidInputError(
                f"operations must be names of {', '.join(OPERATIONS)}, got {shown(operation)}", ("operations",)
            )
        chosen |= {STEPS.index(step) for step in OPERATIONS[operation]}
    return sorted(chosen)


def _cube(at: float = 0.0) -> Polyhedron:
    corners = [[at + (i & 1), float(i >> 1 & 1), float(i >> 2 & 1)] for i in range(8)]
    faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    return Polyhedron(corners, faces)


def regions_of(dimension: int) -> list[Solid]:
    """Return one solid of each type of a dimension, without types that only some operations take."""
    first = np.eye(dimension)[0]
    simple: list[Solid] = [
        HalfSpace(first, 0.5),
        Sphere(first, 1.0),
        Aabb(np.zeros(dimension), np.ones(dimension)),
        Convex(np.column_stack([np.eye(dimension), np.ones(dimension)])),
    ]
    return [*simple, Polygon([[[0, 0], [4, 0], [1, 1], [0, 4]]]) if dimension == 2 else _cube()]


def _warm_containment() -> None:
    _locate(2)
    _locate(3)


def _locate(dimension: int) -> None:
    points = np.linspace(-0.5, 1.5, 12 * dimension).reshape(-1, dimension)
    corners = np.vstack([np.zeros(dimension), np.eye(dimension)])[:3]
    terms = Implicit([{"powers": [2] * dimension, "coefficient": 1.0}])
    solids = [*regions_of(dimension), Triangle(corners), terms]
    poses: list[Pose | None] = [Pose(np.eye(dimension), np.full(dimension, 0.25))] * len(solids)
    for solid in solids:
        locate(points, solid)
    many = np.tile(points, (4, 1))  # a few are located body by body
    locate_scene(many, solids, poses)
    locate_scene(many, solids)
    with Budget() as budget:  # what a scene asks of a single body, where its first pass is not sure
        for solid, pose in zip(solids, poses):
            posed_locator(solid, pose).fill(as_points(points, dimension), np.empty(len(points), np.int8), budget)
            rational_location(points[0].tolist(), solid)


def _warm_cells() -> None:
    """Build grids of cells for a cube and a ring of 300 edges, and a tree as one of very many items is built."""
    many, cube = np.random.default_rng(0).uniform(-1.2, 1.2, (_MANY, 3)), _cube()
    build_bvh(np.concatenate([many, many], axis=1), many=_MANY)
    locate(many, cube)
    locate_scene(many, [cube])
    around = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    locate(np.ascontiguousarray(many[:, :2]), Polygon([np.column_stack([np.cos(around), np.sin(around)])]))


def _warm_poses() -> None:
    box = mesh_body_of(Aabb([0, 0, 0], [1, 1, 1]))
    relate(box, box, (STILL, STILL), SEEK_OVERLAP, Work())  # one of the two longest kernels, and little else
    for first in _bodies():
        _collide_under_poses(first)
    turns, moves = np.broadcast_to(np.eye(3), (36, 3, 3)), np.repeat([[0.5, 0, 0], [1, 0, 0], [5, 0, 0]], 12, axis=0)
    collide_poses(_cube(), _cube(0.5), turns, moves)  # eight at a time


def _collide_under_poses(first: Solid) -> None:
    moves = np.array([[0.5, 0, 0], [1, 0, 0], [5, 0, 0]])
    collide_poses(first, _cube(), np.broadcast_to(np.eye(3), (3, 3, 3)), moves, witnesses=True)


def _warm_forms() -> None:
    for first in _bodies():
        for other in (HalfSpace([1, 0, 0], -0.5), Sphere([0, 0, 0], 1)):
            collide(first, other)


def _warm_collision() -> None:
    for first in _bodies():
        for other in (_cube(1.0), _cube(0.5)):
            collide(first, other)
    cube = _cube()
    collide(Polyhedron(cube.vertices, np.concatenate([cube.triangles] * 2)), _cube(0.5))  # faces that cancel: regions


def _warm_scenes() -> None:
    collide_scene(_bodies())
    Scene(_bodies()).collide(moved=[0])


def _warm_flat_bodies() -> None:
    for scene in [Scene([Sphere([0, 0, 0], 1)])] * 2:  # a question after the first
        scene.locate([[0.25, 0, 0]])
    many = [Aabb([k, 0, 0], [k + 2, 1, 1]) for k in range(300)]
    collide_scene(many)  # their boxes go into a grid
    flat: list[Solid] = [Polygon([[[0, 0], [4, 0], [1, 1], [0, 4]]]), Triangle([[0, 0], [1, 0], [0, 1]])]
    collide_scene(flat * 5)
    crossing = Triangle([[0.5, 0.25], [5, 1], [1, 5]])
    collide(flat[0], crossing)
    for at in (None, Pose([[0.6, -0.8], [0.8, 0.6]], [5, 5])):
        clearance(flat[0], crossing, second_pose=at)
    for dimension in (2, 3):
        corners = np.vstack([np.zeros(dimension), np.eye(dimension)])[None, :3]
        collide_triangles(corners, corners + 0.25)


_LINES = np.array([[[-1.0, 0.3, 0.2], [2.0, 0.4, 0.1]]])


def _warm_hits() -> None:
    Scene([_cube()], [Pose.from_quaternion([3, 1, 0, 0], [0.25, 0, 0])]).hits(_LINES)
    hits([[[-1.0, 0.5, 0.25], [2.0, 0.5, 0.5]]], _cube())


def _warm_scene_clipping_2d() -> None:
    _clip_scene(regions_of(2), Pose([[0.6, -0.8], [0.8, 0.6]], [0.25, 0]))


def _warm_scene_clipping_3d() -> None:
    pose = Pose.from_quaternion([3, 1, 0, 0], [0.25, 0, 0])
    _clip_scene([*regions_of(3), *_bodies()[1:2]], pose)
    Scene([_cube()], [pose]).clip_segments([np.array([[0.0, 0, 0], [1.0, 0, 0]]) @ pose.rotation.T + pose.translation])


def _clip_scene(some: list[Solid], pose: Pose) -> None:
    segments = _LINES[:, :, : pose.dimension]
    scene = Scene(some * 2, [None] * len(some) + [pose] * len(some))
    for keep in ("all", "first", "any"):
        scene.clip_segments(segments, keep=keep)
    scene.clip_segments(np.tile(segments, (10_000, 1, 1)), keep="any")  # put in order


def _bodies() -> list[Solid]:
    Surface([[0, 0, 0], [2, 0, 0], [0.5, 0.5, 0], [0, 2, 0]], [[0, 1, 2, 3]])  # not convex: ears are cut
    sheet = Surface([[0, 0, 0.5], [2, 0, 0.5], [0, 2, 0.5]], [[0, 1, 2]])
    return [_cube(), sheet, Aabb([0, 0, 0], [1, 1, 1])]


def _warm_clipping_2d() -> None:
    _clip(2)
    corners = [[[-1.0, -1.0], [2.0, 2.0]], [[0.0, 0.0], [1.0, 1.0]]]  # through corners, and from one to another
    clip_segments(corners, Polygon([[[0, 0], [4, 0], [1, 1], [0, 4]]]))


def _warm_clipping_3d() -> None:
    _clip(3)
    clip_segments([[[-3.0, -3.0, -1.0], [3.0, 3.0, 1.0]]], _cube())  # through a corner, its middle inside no double


def _clip(dimension: int) -> None:
    segments = np.linspace(-1.0, 2.0, 8 * dimension).reshape(4, 2, dimension)
    for region in regions_of(dimension):
        clip_segments(segments, region)
        clip_lines(segments, region)


def _warm_clipping_polygons() -> None:
    for dimension in (2, 3):
        contour = np.array([[-1.0, -1.0, 0.5], [2.0, 0.0, 0.5], [0.0, 2.0, 0.5]])[:, :dimension]
        for region in regions_of(dimension):
            if region.type not in ("sphere", "polygon"):
                clip_polygons([[contour]], region)


def _warm_overlay() -> None:
    first = Polygon([[[0, 0], [4, 0], [1, 1], [0, 4]]])
    float(overlay(first, Polygon([[[0.5, 0.3], [5, 1], [1, 5]]])).area)
    overlay_batch([first, first], [first, first])


def _warm_overlay_rest() -> None:
    _warm_layers()  # first what needs no kernel of `_warm_overlay`
    angles = np.linspace(0.0, 2.0 * np.pi, 2048, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    overlay(Polygon([circle]), Polygon([circle + 0.5]))  # large ones, of which few edges are looked at
    overlay(Polygon([circle]), Polygon([circle + 0.5]), grid=0.5)
    overlay(Polygon([circle]), Polygon([circle + 0.5]), grid=1e-14)  # distinguishable as doubles, but not certainly
    corner = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    union_all([Polygon([corner + np.array([x, y])]) for x in range(8) for y in range(8)])  # many, that share edges
    union_all([Polygon([circle[::512] + 3.0 * k]) for k in range(160)])  # many, that share none
    # Edges an ulp apart are left to the path in integers, whose kernels look for pairs of boxes.
    near = 1.0 + 2.0**-52
    overlay(Polygon([[[0, 0], [1, 1], [0, 1]]]), Polygon([[[0, 0], [1, near], [near, 0.5]]]), "union")


def _warm_layers() -> None:
    points, square = [[0.5, 0.5], [9.0, 9.0]], [[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]]
    kinds = ("MultiPoint", points), ("LineString", points), ("Polygon", square), ("Point", [9, 0]), ("Point", [0, 9])
    geometries = [{"type": kind, "coordinates": coordinates} for kind, coordinates in kinds]
    features, limits = [{"type": "Feature", "geometry": each} for each in geometries], Limits(None, None)
    layer, others = (
        mixed_of(collection_of({"type": "FeatureCollection", "features": some}, ("layer",), limits, EVERY), limits)
        for some in (features, features[3:])
    )
    related_pairs(layer, layer, "within", 0.0, limits)
    related_pairs(layer, layer, "dwithin", 0.25, limits)
    nearest_of(layer, others, np.inf, False, limits)  # two are as near as each other


def _warm_distances() -> None:
    for solid in (_cube(), Sphere([0, 0, 0], 1), HalfSpace([1, 0, 0], -9)):
        distances([[3.0, 0.25, 0.5]], solid)
    distances([[3.0, 0.25, 0.5]], Triangle([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), nearest=True)
    Scene([_cube(), Sphere([9, 0, 0], 1)]).distances([[3.0, 0.25, 0.5]])


def _warm_bounds() -> None:
    for dimension in (2, 3):
        for solid in regions_of(dimension):
            with contextlib.suppress(Exception):  # unbounded ones are refused
                bounds(solid)
    cube = _cube(5.0)
    for body in (Sphere([0, 0, 0], 1), HalfSpace([1, 0, 0], -9), cube, Surface(cube.vertices, cube.triangles)):
        clearance(body, Sphere([3, 0, 0], 1))
    collide_scene([Sphere([0, 0, 0], 1), Sphere([3, 0, 0], 1)], gap=2.0)
    orientations(*np.zeros((4, 1, 3)))  # of meshes that are inspected


def _warm_clearances() -> None:
    for body in (HalfSpace([0, 0, 1], -9), _cube()):
        clearance_poses(body, _cube(), np.eye(3)[None], [[9.0, 0.25, 0.5]])


def _warm_cutting() -> None:
    cube = _cube()
    notched = Polyhedron(*_notched())
    for solid in (cube, notched):
        volume(solid), area(solid), centroid(solid)
        section(solid, [0.25, 0.5, 0.6, 0.75])
        for keep in (HalfSpace([1, 0.25, 0.5], -0.6), Aabb([0.2] * 3, [0.8] * 3)):
            made = cut(solid, keep, measures=True)
            made.solid  # noqa: B018
    overlap_volume(cube, Aabb([0.2] * 3, [0.8] * 3))
    overlap_volume(notched, Aabb([0.2] * 3, [0.8] * 3))
    squares = np.array([[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]])
    iou(squares, squares + 1.0)
    iou(squares, np.array([[1.0, 1.0, 2.0, 2.0, 0.5]]))


def _notched() -> tuple[Any, Any]:
    """Return a cube with a cube cut out of a corner of it, and a cavity: not convex, with holes in its sections."""
    inner = _cube(0.5)
    outer = _cube()
    return (
        np.concatenate([outer.vertices * 4.0 - 1.0, inner.vertices]),
        np.concatenate([outer.triangles, inner.triangles + len(outer.vertices)]),
    )


STEPS = (
    _warm_poses,
    _warm_overlay,
    _warm_clipping_polygons,
    _warm_flat_bodies,
    _warm_clipping_3d,
    _warm_scene_clipping_2d,
    _warm_bounds,
    _warm_hits,
    _warm_containment,
    _warm_overlay_rest,
    _warm_clearances,
    _warm_distances,
    _warm_cutting,
    _warm_forms,
    _warm_scene_clipping_3d,
    _warm_cells,
    _warm_clipping_2d,
    _warm_scenes,
    _warm_collision,
)
"""Parts of the work, in the best order tried for 4 to 32 processes: the two longest kernels (poses of meshes, overlay)
begin, what needs them comes late. What several need is compiled by the first, the others wait (cold_start.py)."""
SHARES = (15, 12, 6, 7, 2, 12, 3, 1, 4, 6, 3, 10, 6, 2, 7, 1, 1, 1, 1)
"""Duration of each of `STEPS`, in the order of `RELATED`, in per cent."""
RELATED = ((0, 13, 18, 17, 3, 10, 6), (1, 9), (5, 14, 16, 4, 2, 7), (11, 12, 8, 15))
"""Indices of steps that compile much the same, long ones first. One of few processes calls them, since inner functions
that two need both compile; of more than there are such lists each calls the next step."""
_LOCATING, _CLIPPING = (_warm_containment, _warm_cells), (_warm_clipping_2d, _warm_clipping_3d)
_COLLIDING, _OVERLAYING = (_warm_collision, _warm_forms), (_warm_overlay, _warm_overlay_rest)
_IN_SCENES = (_warm_scenes, _warm_flat_bodies)
OPERATIONS = {
    "locate": _LOCATING,
    "contains": _LOCATING,
    "locate_scene": (*_LOCATING, *_IN_SCENES),
    "collide": (*_COLLIDING, *_IN_SCENES),
    "collide_poses": (_warm_poses, *_COLLIDING),
    "collide_scene": (*_COLLIDING, *_IN_SCENES),
    "clearance": (_warm_bounds, _warm_clearances, *_IN_SCENES),
    "distances": (_warm_distances,),
    "clip_segments": _CLIPPING,
    "clip_lines": _CLIPPING,
    "hits": (_warm_hits,),
    "clip_polygons": (_warm_clipping_polygons,),
    "Scene": (*_LOCATING, *_IN_SCENES, _warm_hits, _warm_scene_clipping_2d, _warm_scene_clipping_3d),
    **dict.fromkeys(("overlay", "overlay_batch", "union_all"), _OVERLAYING),
    "bounds": (_warm_bounds,),
    **dict.fromkeys(("volume", "area", "centroid", "section", "cut", "overlap_volume", "iou"), (_warm_cutting,)),
}
"""The steps of each operation."""
