"""Fast path for small batches without options: compiled code is entered directly, with cached arguments.

The general way costs some 15 us before the first decision: budget, chunks, the compiler's look at types. A plan names
the compiled code and its arguments; it checks no types, so points become what it was compiled for before.
"""

from __future__ import annotations

from typing import Any, Final, TypeAlias

import numpy as np

from engine.arrays import FloatArray, Int8Array
from engine.compiling.direct import entry_of
from engine.containment.locators import Locator, locator_of, polygon_by, polyhedron_by, rational_half, settle
from engine.containment.methods.filters import NOT_FINITE
from engine.containment.methods.rational_locate import is_located
from engine.containment.policy import Choice, choose_for_mesh, choose_for_rings
from engine.running.budget import UNLIMITED
from engine.solids.base import Solid
from engine.solids.checks import DOUBLE, as_points, check_finite, plain_floats
from engine.solids.polygon import Polygon
from engine.solids.polyhedron import Polyhedron
from engine.solids.registry import row_of
from engine.types import UNDECIDED

MOST: Final = 1024
"""Points: more are a chunk of the general way."""
_SMALL: Final = 32
"""Edges of a polygon that is passed over whatever the number of points."""
_NO_FLAG: Final = np.zeros(1, np.uint8)
_KEYS: Final = {Choice.PASS: "pass_plan", Choice.LISTS: "list_plan", Choice.CELLS: "plan"}

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
        if not is_located(row_of(solid)):
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
        plan = _plan_of(solid, n_points)
        if plan is None:
            return None
    entry, prepared, method = plan
    locations = np.empty(n_points, np.int8)
    n_beyond = entry(array, *prepared, locations, _NO_FLAG)
    return (locations, 0, 0, method) if n_beyond == 0 else _settled(array, solid, locations, n_beyond, method)


def _settled(array: FloatArray, solid: Solid, locations: Int8Array, n_beyond: int, method: str) -> Located:
    if n_beyond == NOT_FINITE:
        check_finite(array, ("points",))
    rest = np.flatnonzero(locations == UNDECIDED)
    return locations, n_beyond, settle(rational_half(solid), array, locations, rest, UNLIMITED), method


def _plan_of(solid: Solid, n_points: int) -> Plan | None:
    """Return a plan, kept where one is made; None where cells are chosen, or no kernel is compiled yet."""
    if isinstance(solid, Polygon) and len(solid.vertices) <= _SMALL:
        return _kept(solid, "plan", polygon_by(solid, Choice.PASS, UNLIMITED))
    if isinstance(solid, Polygon):
        choice = choose_for_rings(solid, n_points)
        return solid.kept(_KEYS[choice]) or _kept(solid, _KEYS[choice], polygon_by(solid, choice, UNLIMITED))
    if isinstance(solid, Polyhedron):
        choice = choose_for_mesh(solid, n_points)
        if choice == Choice.CELLS:
            return None
        return solid.kept(_KEYS[choice]) or _kept(solid, _KEYS[choice], polyhedron_by(solid, choice, UNLIMITED))
    return _kept(solid, "plan", locator_of(solid).chosen(n_points, UNLIMITED))


def _kept(solid: Solid, key: str, locator: Locator) -> Plan | None:
    if not locator.direct:
        return None
    kernel, *prepared = locator.direct
    entry = entry_of(kernel)
    if entry is kernel:
        return None
    plan: Plan = entry, tuple(prepared), locator.method
    return solid.prepared(key, lambda: plan)
