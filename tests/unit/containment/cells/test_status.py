"""Sides of cells: empty ones that share a wall copy from the first of them."""

from __future__ import annotations

import numpy as np

from engine.containment.cells.status import label_empty


def test_each_empty_cell_is_joined_with_its_copy_by_empty_cells() -> None:
    nx, ny, nz = 4, 3, 5
    counts = np.random.default_rng(0).integers(0, 2, nx * ny * nz)
    labels = np.empty(len(counts), np.int64)
    label_empty(counts, nx, ny, labels)
    assert (labels[counts > 0] == np.flatnonzero(counts)).all()
    group = np.arange(len(counts))  # the least empty cell that each empty one is joined with
    empty = counts.reshape(nz, ny, nx) == 0
    for _ in range(len(counts)):
        cube = group.reshape(nz, ny, nx)
        for axis in range(3):
            first, second = np.moveaxis(cube, axis, 0)[:-1], np.moveaxis(cube, axis, 0)[1:]
            both = np.moveaxis(empty, axis, 0)[:-1] & np.moveaxis(empty, axis, 0)[1:]
            least = np.minimum(first, second)
            first[both] = least[both]
            second[both] = np.minimum(second, least)[both]
    assert (group[labels] == group).all()
    assert (counts[labels[counts == 0]] == 0).all()
