"""Few points in few bodies: each body is asked by itself, which is sooner done than tables of all of them are made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.arrays import FloatArray, Int8Array
from engine.budget import Budget
from engine.containment.at_once import located_at_once
from engine.containment.locators import Counts
from engine.containment.posed.locators import posed_locator
from engine.errors import EngineError
from engine.solids.base import Solid
from engine.solids.pose import Pose

_FEW_POINTS: Final = 32
_FEW_BODIES: Final = 16
_SMALL: Final = 1000
"""Vertices of a body whose lists are soon built, though no point may lie in its box."""


def are_few(points: FloatArray, solids: Sequence[Solid]) -> bool:
    """Tell whether so few points are best asked about body by body."""
    if not (0 < len(points) <= _FEW_POINTS and 0 < len(solids) <= _FEW_BODIES):
        return False
    return all(len(getattr(solid, "vertices", ())) <= _SMALL for solid in solids)


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
