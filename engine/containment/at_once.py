"""Few points, asked without options: compiled code is entered directly, with what it reads kept with the solid.

The general way costs some 15 us before the first decision: budget, chunks, the compiler's look at types. A plan names
the compiled code and its arguments; it checks no types, so points become what it was compiled for before.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any, Final, NamedTuple

import numpy as np

from engine.arrays import FloatArray, Int8Array
from engine.containment.locators import locator_of
from engine.containment.methods.half_spaces import locate_in_half_spaces
from engine.containment.methods.polygon_one_pass import locate_by_ring_pass
from engine.containment.methods.polygon_ray_parity import locate_in_rings
from engine.containment.methods.polyhedron_one_pass import locate_by_pass
from engine.containment.methods.polyhedron_ray_parity import locate_by_tree
from engine.containment.policy import PASS, choose_for_mesh, ring_pass_pays
from engine.containment.prepared import closed_rings_of
from engine.containment.rational_locate import rational_location
from engine.parallel import Budget
from engine.solids.aabb import Aabb
from engine.solids.base import Solid
from engine.solids.checks import as_points, check_finite
from engine.solids.convex import Convex
from engine.solids.half_space import HalfSpace
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.sphere import Sphere
from engine.solids.triangle import Triangle
from engine.types import UNDECIDED

MOST: Final = 1024
"""Points: more are a chunk of the general way."""
_FEW: Final = 64
"""Points for which cells, if there are any, are not worth the general way."""
_FEW_RAYS: Final = 256
"""Of points through faces: a pass over so many costs less than to hand over a tree."""
_NO_BLUR: Final = np.zeros(MOST)
_NO_FLAG: Final = np.zeros(1, np.uint8)
_DOUBLE: Final = np.dtype(np.float64)


class Plan(NamedTuple):
    """Compiled code, what stands between points and locations among its arguments, and the method's name."""

    entry: Callable[..., int]
    prepared: tuple[Any, ...]
    method: str


class Located(NamedTuple):
    """Locations (n,), how many points took more than the filter, how many rational arithmetic, and the method."""

    locations: Int8Array
    beyond: int
    rational: int
    method: str


def located_at_once(points: object, solid: Solid) -> Located | None:
    """Return where points lie in a solid, None where the general way must be gone. Raises as `locate` does."""
    maker = _PLANS.get(type(solid))
    if maker is None or not isinstance(points, (np.ndarray, list, tuple)) or not 0 < _length(points) <= MOST:
        return None
    array = _as_points(points, solid.dimension)
    plan = solid.kept("plan") or maker(solid, len(array))
    if plan is None:
        return None
    if not isfinite(np.vdot(array, array)):  # or squares out of range
        check_finite(array, ("points",))
    locations = np.empty(len(array), np.int8)
    n_beyond = plan.entry(array, *plan.prepared, locations, _NO_FLAG)
    n_rational = 0
    if n_beyond:
        for item in np.flatnonzero(locations == UNDECIDED):
            locations[item] = rational_location(array[item].tolist(), solid)
            n_rational += 1
    return Located(locations, n_beyond, n_rational, plan.method)


def _length(points: Any) -> int:
    return 0 if isinstance(points, np.ndarray) and points.ndim == 0 else len(points)


def _as_points(points: Any, dimension: int) -> FloatArray:
    """Return `as_points`, which is left out where nothing is to be done."""
    if type(points) is np.ndarray and points.dtype is _DOUBLE and points.ndim == 2 and points.shape[1] == dimension:
        flags = points.flags
        if flags.c_contiguous and flags.aligned:
            array = points.view()
            array.flags.writeable = False
            return array
    return as_points(points, dimension, must_be_finite=False)


def _kept(solid: Solid, method: str, kernel: Any, *prepared: Any, key: str = "plan") -> Plan | None:
    """Return the plan of a kernel that is compiled for one kind of arguments by now, prepared once."""
    compiled = getattr(kernel, "dispatcher", None)
    if compiled is None or len(compiled.overloads) != 1:
        return None
    entry = next(iter(compiled.overloads.values())).entry_point
    return solid.prepared(key, lambda: Plan(entry, prepared, method))


def _in_one_way(solid: Solid, _: int) -> Plan | None:
    locator = locator_of(solid)
    return _kept(solid, locator.method, *locator.direct)


def _in_triangle(solid: Triangle, _: int) -> Plan | None:
    if solid.dimension == 2:
        return _kept(solid, "same_side", locate_by_ring_pass, _NO_BLUR, *closed_rings_of(solid))
    walls = solid.kept("rounded_walls")
    return None if walls is None else _kept(solid, "prism", locate_in_half_spaces, *walls)


def _in_polygon(solid: Polygon, n_points: int) -> Plan | None:
    if ring_pass_pays(solid, n_points):
        plan, method = solid.kept("pass_plan"), "ring_crossing"
        return plan or _kept(solid, method, locate_by_ring_pass, _NO_BLUR, *closed_rings_of(solid), key="pass_plan")
    slabs = solid.kept("slabs") if n_points <= _FEW else None
    return slabs and (
        solid.kept("list_plan") or _kept(solid, "ring_crossing", locate_in_rings, _NO_BLUR, *slabs, key="list_plan")
    )


def _in_polyhedron(solid: Polyhedron, n_points: int) -> Plan | None:
    if n_points > _FEW:
        return None
    if n_points * len(solid.triangles) > _FEW_RAYS:
        if tree := solid.kept("tree"):
            plan = solid.kept("list_plan")
            return plan or _kept(solid, "ray_parity", locate_by_tree, _NO_BLUR, tree, key="list_plan")
        if choose_for_mesh(solid, n_points, Budget()) != PASS:
            return None
    plan, prepared = solid.kept("pass_plan"), (solid.vertices, solid.triangles)
    return plan or _kept(solid, "ray_parity", locate_by_pass, *prepared, key="pass_plan")


_PLANS: Final[dict[type[Solid], Callable[..., Plan | None]]] = {
    HalfSpace: _in_one_way,
    Convex: _in_one_way,
    Sphere: _in_one_way,
    Aabb: _in_one_way,
    Triangle: _in_triangle,
    Polygon: _in_polygon,
    Polyhedron: _in_polyhedron,
}
