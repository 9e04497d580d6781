"""Layers of polygons as maps have them: overlays with attributes, and joins of neighbours that touch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import islice

import numpy as np

from benchmarks import errors, polygon_pairs
from benchmarks.contenders import Prepared
from benchmarks.contest import Contender, Contest, Size, Task, field_of
from benchmarks.fields.collision import asked_of_layers

PREDICATE = "touches"
JUDGED = 400
"""Rows of the overlay."""


def tasks(size: Size) -> Iterator[Task]:
    """Yield the rows, one thread, from frame to frame."""
    yield Task("overlay of parcels", partial(_overlay, size), True)
    for is_hard in (False, True):
        yield Task(f"join of {'split' if is_hard else 'whole'} parcels", partial(_join, size, is_hard), True)


def _overlay(size: Size) -> Contest:
    """Two layers whose parcels meet some four of the other: an area a row."""
    both = [polygon_pairs.parcels(size.n(5_000, 200), size.seed + side) for side in range(2)]
    result = field_of("layers", "intersection", ("geopandas",), 1)
    pairs = errors.boxes_that_meet(*both)
    areas = (errors.overlay_area(([both[0][a]], [both[1][b]])) for a, b in pairs)
    judged = np.array(list(islice((area for area in areas if area[0] > 0.0), JUDGED)))
    about = f"two layers of {len(both[0]):,} quadrilaterals, each meets some four of the other: an area a row"
    return Contest("layers", "overlay of parcels", False, both, judged, errors.areas, result, about, count=len(both[0]))


def _join(size: Size, is_hard: bool) -> Contest:
    """Which parcel touches which? Hard: parcels of the second layer are halves, their cuts rounded onto the sides."""
    left, right = polygon_pairs.parcels_and_parts(size.n(225, 100), size.seed, is_hard)
    pairs = errors.boxes_that_meet(left, right)
    exact = errors.relations(left, right, pairs) == 4
    made = [replace(each, make=partial(_among, each, pairs, len(right)))
            for each in field_of("join", PREDICATE, ("geopandas",), 1)]  # fmt: skip

    about = f"{len(left)} parcels and " + ("their halves, whose new corners are rounded" if is_hard else "themselves")
    name = f"join of {'split' if is_hard else 'whole'} parcels"
    return Contest("layers", name, is_hard, (left, right), exact, errors.same, made,
                   f"{about}: does a pair touch, without common area?", count=len(pairs),
                   request=partial(asked_of_layers, left, right, pairs))  # fmt: skip


def _among(one: Contender, pairs: np.ndarray, n_right: int) -> Prepared:
    """Return the contender, its answer as one label for each pair whose boxes meet."""
    made, codes = one.make(), pairs @ [n_right, 1]
    return replace(made, answer=lambda result: np.isin(codes, made.answer(result) @ [n_right, 1]))
