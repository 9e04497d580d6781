"""Hard points of every family, by a pass over the triangles, by a tree and by cells: all exact, or the test fails."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine import Polyhedron, locate
from engine.containment import locators
from engine.containment.cells.lattice import can_have_cells
from engine.containment.policy import Choice
from tests.hard.points import STORED, generated_solids, hard_points
from tests.reference.many_points import locate_points

METHODS = {"pass": Choice.PASS, "tree": Choice.LISTS, "cells": Choice.CELLS}
MESHES = {
    "c3d_spot": (0.0, 1e6),
    "syn_sliver_uv": (0.0, 1e9),
    "syn_menger2": (0.0, 1e6),
    "syn_bracket": (1e9,),
    "syn_gear": (1e9,),
    "tm_rabbit": (0.0, 1e6),
    "tm_cycloidal": (0.0, 1e9),
    "tm_quadknot": (0.0,),
    "tm_unit_cube": (0.0, 1e9),
    "igl_decimated-knight": (0.0,),
    "c3d_fandisk": (0.0,),
    "syn_voxrand": (0.0,),
}
"""Real and generated meshes of the shared folder, with the offsets at which they are asked. tm_rabbit crosses itself;
tm_cycloidal and syn_voxrand are not manifold; syn_menger2 has stacked coplanar faces."""
PLACES = [(name, offset) for name, offsets in MESHES.items() for offset in offsets]


def assert_exact(points: Any, vertices: Any, faces: Any, exact: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    solid = Polyhedron(vertices, faces)
    for name, method in METHODS.items():
        if method == Choice.CELLS and not can_have_cells(solid):
            continue
        monkeypatch.setattr(locators, "choose_for_mesh", lambda *_, method=method: method)
        found = locate(points, solid)
        wrong = np.flatnonzero(found != exact)
        assert not len(wrong), (name, len(wrong), points[wrong[0]].tolist(), int(found[wrong[0]]), int(exact[wrong[0]]))


def check(name: str, vertices: Any, faces: Any, n_each: int, monkeypatch: pytest.MonkeyPatch) -> int:
    points = np.concatenate([points for _, points in hard_points(name, vertices, faces, n_each)])
    assert_exact(points, vertices, faces, locate_points(points, vertices, faces), monkeypatch)
    return len(points)


def test_stored_points(monkeypatch: pytest.MonkeyPatch) -> None:
    stored = np.load(STORED)
    for number in range(len(stored.files) // 5):
        name, vertices, faces, points, exact = (
            stored[f"{number}_{what}"] for what in ("name", "vertices", "faces", "points", "location")
        )
        assert {-1, 0, 1} >= set(exact.tolist()) >= {-1, 0}, name
        some = slice(number, None, 20)
        assert (locate_points(points[some], vertices, faces) == exact[some]).all(), name
        assert_exact(points, vertices, faces, exact, monkeypatch)


@pytest.mark.parametrize("name", generated_solids())
def test_generated_solids(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check(name, *generated_solids()[name], 30, monkeypatch)


@pytest.mark.data
@pytest.mark.parametrize(("name", "offset"), [(name, offsets[-1]) for name, offsets in MESHES.items()])
def test_meshes(data: Path, name: str, offset: float, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = np.load(data / "meshes" / f"{name}.npz")
    check(f"{name} {offset}", mesh["vertices"] + offset, mesh["faces"].astype(np.int64), 20, monkeypatch)


@pytest.mark.full
@pytest.mark.data
def test_ten_times_the_hard_sets(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    n_points = sum(check(name, *solid, 900, monkeypatch) for name, solid in generated_solids().items())
    for name, offset in PLACES:
        mesh = np.load(data / "meshes" / f"{name}.npz")
        n_points += check(
            f"all {name} {offset}", mesh["vertices"] + offset, mesh["faces"].astype(np.int64), 1100, monkeypatch
        )
    assert n_points >= 240_000
    print(f"{n_points:,} hard points, each by three methods: 0 wrong")
