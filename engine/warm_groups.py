"""Groups of kernels, each compiled by one process with a cache of its own: the same bytes whatever the machine."""

from __future__ import annotations

import contextlib
import os
from typing import Any

import numpy as np

from engine.solids.checks import as_points
from engine.solids.csg import Csg
from engine.solids.implicit import Implicit
from engine.solids.primitives import Triangle
from engine.warmup import RELATED, STEPS, regions_of

GROUPS = (RELATED[0] + RELATED[3], RELATED[1] + RELATED[2])
"""Indices of the steps that one process each calls where the same bytes are wanted whatever the machine: their order
decides symbols and inlining. What both compile is that of the first."""


def call_group(index: int) -> None:
    """Call the steps of one of `GROUPS`, and compile what only `compare` asks; on one core, so that no other thread
    compiles: the order in which functions are compiled is part of their names."""
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[index % len(cores)]})
    with contextlib.suppress(ImportError, AttributeError):  # without it kernels are as right
        from engine.compiling.compilers import forget_paths

        forget_paths()
    for step in GROUPS[index]:
        STEPS[step]()
    if index == len(GROUPS) - 1:
        warm_textbook()


def warm_textbook() -> None:
    """Ask every textbook method that `compare` offers; not a step, since hardly anybody asks more than one."""
    from engine.textbook import methods

    for dimension in (2, 3):
        points = as_points(np.linspace(-0.5, 1.5, 6 * dimension).reshape(-1, dimension), dimension)
        corners = np.eye(3)[:, :dimension]
        terms = Implicit([{"powers": [2] * dimension, "coefficient": 1.0}])
        for solid in (*regions_of(dimension), Triangle(corners), terms, Csg("union", regions_of(dimension)[:3])):
            questions: list[tuple[methods.Methods, tuple[Any, ...]]] = [
                (methods.of_points(solid), (points,)),
                (methods.of_segments(solid), (points.reshape(3, 2, dimension),)),
                (methods.of_polygons(solid), (points.reshape(2, 3, dimension),)),
                (methods.of_pairs(solid, solid), ()),
            ]
            for offered, arguments in questions:
                for ask, _ in offered.values():
                    ask(*arguments)
