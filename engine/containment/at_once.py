"""Few points, asked without options: compiled code is entered directly, with what it reads kept with the solid; and few
points in few bodies, each asked by itself, which is sooner done than tables of all of them are made.

The general way costs some 15 us before the first decision: budget, chunks, the compiler's look at types. A plan names
the compiled code and its arguments; it checks no types, so points become what it was compiled for before.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, TypeAlias

import numpy as np

from engine.arrays import FloatArray, Int8Array
from engine.budget import UNLIMITED, Budget
from engine.containment.locators import Counts, locator_of, polygon_by, polyhedron_by, rational_half, settle
from engine.containment.policy import CELLS, LISTS, PASS, choose_for_mesh, choose_for_rings
from engine.containment.posed.filters import NOT_FINITE
from engine.containment.posed.locators import posed_locator
from engine.containment.rational_locate import combine, over_tree
from engine.direct import entry_of
from engine.errors import EngineError, NotFiniteError
from engine.solids.base import Solid
from engine.solids.checks import DOUBLE, as_points, check_finite, plain_floats
from engine.solids.csg import Csg
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.pose import Pose
from engine.types import UNDECIDED

MOST: Final = 1024
"""Points: more are a chunk of the general way."""
_SMALL: Final = 32
"""Edges of a polygon that is passed over whatever the number of points."""
_NO_FLAG: Final = np.zeros(1, np.uint8)
_KEYS: Final = {PASS: "pass_plan", LISTS: "list_plan", CELLS: "plan"}

Plan: TypeAlias = tuple[Any, tuple[Any, ...], str]
"""Compiled code, what stands between points and locations among its arguments, and the method's name."""
Located: TypeAlias = tuple[Int8Array, int, int, str]
"""Locations (n,), how many points took more than the filter, how many rational arithmetic, and the method."""


def located_at_once(points: object, solid: Solid) -> Located | None:
    """Return where points lie in a solid, None where the general way must be gone. Raises as `locate` does."""
    if not isinstance(solid, Solid):
        return None
    array: Any = points
    if (  # as `is_ready` tells: a call of it would be a tenth of all
        type(array) is not np.ndarray
        or array.dtype is not DOUBLE
        or array.ndim != 2
        or array.shape[1] != solid.dimension
        or not array.flags.carray
    ):
        if not isinstance(points, (np.ndarray, list, tuple)) or getattr(points, "ndim", 1) == 0:
            return None
        if not 0 < len(points) <= MOST:
            return None
        if solid.type == "surface":
            return None
        plain = None if isinstance(points, np.ndarray) else plain_floats(points, 2)
        if plain is not None and plain.shape[1] == solid.dimension:
            array = plain
        else:
            array = as_points(points, solid.dimension, must_be_finite=False)
    n_points = len(array)
    if not 0 < n_points <= MOST:
        return None
    plan = solid.kept("plan")
    if plan is None:
        if type(solid) is Csg:
            return _in_tree(array, solid)
        choice, plan = _plan_of(solid, n_points)
        if choice == CELLS:
            return _in_cells(array, solid)
        if plan is None:
            return None
    entry, prepared, method = plan
    locations = np.empty(n_points, np.int8)
    n_beyond = entry(array, *prepared, locations, _NO_FLAG)
    return (locations, 0, 0, method) if n_beyond == 0 else _settled(array, solid, locations, n_beyond, method)


def _settled(array: Any, solid: Solid, locations: Int8Array, n_beyond: int, method: str) -> Located:
    if n_beyond == NOT_FINITE:
        check_finite(array, ("points",))
    rest = np.flatnonzero(locations == UNDECIDED)
    return locations, n_beyond, settle(rational_half(solid), array, locations, rest, UNLIMITED), method


def _in_cells(array: Any, solid: Solid) -> Located:
    by: Any = polygon_by if isinstance(solid, Polygon) else polyhedron_by
    locator, locations = by(solid, CELLS, UNLIMITED), np.empty(len(array), np.int8)
    try:
        counts = locator.fill(array, locations, UNLIMITED)
    except NotFiniteError:
        check_finite(array, ("points",))
        raise
    return locations, *counts, locator.method


def _plan_of(solid: Solid, n_points: int) -> tuple[int, Plan | None]:
    """Return the choice of policy.py and a plan, kept where one is made; None where no kernel is compiled yet."""
    if isinstance(solid, Polygon):
        if len(solid.vertices) <= _SMALL:
            return PASS, _kept(solid, "plan", polygon_by(solid, PASS, UNLIMITED))
        by: Any = polygon_by
        choice = choose_for_rings(solid, n_points)
    elif isinstance(solid, Polyhedron):
        choice, by = choose_for_mesh(solid, n_points, UNLIMITED), polyhedron_by
    else:
        return PASS, _kept(solid, "plan", locator_of(solid).chosen(n_points, UNLIMITED))
    if choice == CELLS and isinstance(solid, Polyhedron):
        return choice, None
    return PASS, solid.kept(_KEYS[choice]) or _kept(solid, _KEYS[choice], by(solid, choice, UNLIMITED))


def _kept(solid: Solid, key: str, locator: Any) -> Plan | None:
    if not locator.direct:
        return None
    kernel, *prepared = locator.direct
    entry = entry_of(kernel)
    if entry is kernel:
        return None
    plan: Plan = entry, tuple(prepared), locator.method
    return solid.prepared(key, lambda: plan)


def _in_tree(array: Any, solid: Csg) -> Located | None:
    """Return what `csg_locator` finds, each leaf asked at once; None where one of them cannot be."""
    leaves: dict[int, Located | None] = {}
    over_tree(solid, lambda leaf: leaves.setdefault(id(leaf), located_at_once(array, leaf)), lambda *_: None)
    found = [leaf for leaf in leaves.values() if leaf is not None]
    if len(found) < len(leaves):
        return None
    locations = over_tree(solid, lambda leaf: leaves[id(leaf)][0], combine)  # type: ignore[index]
    beyond, rational = sum(leaf[1] for leaf in found), sum(leaf[2] for leaf in found)
    return locations, min(beyond, len(array)), min(rational, len(array)), "csg_tree"


_FEW_POINTS: Final = 32
_FEW_BODIES: Final = 16
_FEW_VERTICES: Final = 1000
"""Vertices of a body whose lists are soon built, though no point may lie in its box."""


def are_few(points: FloatArray, solids: Sequence[Solid]) -> bool:
    """Tell whether so few points are best asked about body by body."""
    if not (0 < len(points) <= _FEW_POINTS and 0 < len(solids) <= _FEW_BODIES):
        return False
    return all(len(getattr(solid, "vertices", ())) <= _FEW_VERTICES for solid in solids)


def locate_one_by_one(
    points: FloatArray, solids: Sequence[Solid], poses: Sequence[Pose | None] | None, budget: Budget
) -> tuple[Int8Array, Counts, bool]:
    """Return the locations (n_bodies, n_points) of checked points in checked bodies, one of each at least, how many
    took more than the filter, and whether all are exact. Raises: as `locate_scene`."""
    points = points.copy()  # one that may be written to is taken as it is
    located, beyond, rational, is_exact = np.empty((len(solids), len(points)), np.int8), 0, 0, True
    for body, (solid, pose) in enumerate(zip(solids, poses or [None] * len(solids))):
        budget.check()
        try:
            found = located_at_once(points, solid) if pose is None or pose.is_identity else None
            if found is not None:
                located[body], n_beyond, n_rational, _ = found
            else:
                locator = posed_locator(solid, pose)
                is_exact &= locator.decisions == "exact"
                n_beyond, n_rational = locator.chosen(len(points), budget).fill(points, located[body], budget)
        except EngineError as error:
            error.where = ("solids", body, *error.where[1:]) if error.where[:1] == ("solid",) else error.where
            raise
        beyond, rational = beyond + n_beyond, rational + n_rational
    return located, Counts(beyond, rational), is_exact
