"""Questions to bounds, and errors of constructors and operations: names, codes, places and messages."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import engine
from benchmarks.answers import shapes, solids
from benchmarks.answers.asking import Drawn, Question, answered, drawn_by, family
from benchmarks.answers.draws import FAR_PLACES, NEAR_PLACES, Draw


def bounded(solid: Any, workers: int | None) -> tuple[int, Any]:
    result = engine.bounds(solid, workers=workers)
    return 1, [result.aabb.min, result.aabb.max, result.sphere.center, result.sphere.radius]


_BOUNDED: dict[int, tuple[solids.Maker, ...]] = {
    2: (solids.sphere, solids.aabb, solids.triangle, solids.polygon, solids.convex),
    3: (solids.sphere, solids.aabb, solids.triangle, solids.polyhedron, solids.surface, solids.convex),
}


def _bounds_of_each(places: Any, times: int) -> Drawn:
    makers = {dimension: some * times for dimension, some in _BOUNDED.items()}
    return lambda draw: (partial(bounded, shape.solid) for shape in solids.each(draw, makers, places))


family("bounds", "bounds_of_all_solids", 20, _bounds_of_each(NEAR_PLACES, 5))
family("bounds", "bounds_far_away", 5, _bounds_of_each(FAR_PLACES, 1))


@drawn_by("bounds", 4)
def bounds_of_many_vertices(draw: Draw) -> Iterator[Question]:
    yield partial(bounded, solids.polyhedron_of(shapes.ball(draw, 4, draw.pick([0.0, 0.2]))).solid)
    yield partial(bounded, solids.polygon_of(shapes.large_coast(draw)).solid)


REFUSED: dict[str, list[list[Any]]] = json.loads((Path(__file__).parent / "refused.json").read_text("utf-8"))
"""Arguments of each public name that raise an error; {"engine": name, "of": arguments} is made, {"array": numbers}
too."""


def made(value: Any) -> Any:
    """Return the arguments as passed to the engine."""
    match value:
        case {"engine": name, "of": arguments}:
            return getattr(engine, name)(*made(arguments))
        case {"array": numbers}:
            return np.array(numbers)
        case list():
            return [made(each) for each in value]
    return value


@drawn_by("refusals", 1)
def arguments_refused(draw: Draw) -> Iterator[Question]:
    for name, rows in REFUSED.items():
        for row in rows:
            yield partial(_refused, name, made(row))


def _refused(name: str, row: Any, workers: int | None) -> tuple[int, Any]:
    def ask(workers: int | None) -> tuple[int, Any]:
        getattr(engine, name)(*row)
        return 1, "accepted"

    return 1, [name, answered(ask, workers)[1]]


@drawn_by("refusals", 10)
def meshes_broken(draw: Draw) -> Iterator[Question]:
    """Valid meshes with a face removed, flipped, duplicated or renamed: which element the error names."""
    for make in shapes.MESHES:
        vertices, faces = make(draw)
        broken = faces.copy()
        at = draw.one(0, len(faces) - 1)
        match draw.one(0, 4):
            case 0:
                broken = np.delete(broken, at, axis=0)
            case 1:
                broken[at] = broken[at][::-1]
            case 2:
                broken = np.concatenate([broken, broken[at : at + 1]])
            case 3:
                broken[at, 0] = draw.pick([-1, len(vertices), int(broken[at, 1])])
            case _:
                vertices = vertices.copy()
                vertices[draw.one(0, len(vertices) - 1), draw.one(0, 2)] = draw.pick([float("nan"), float("inf")])
        yield partial(_refused, "Polyhedron", (vertices, broken))
        yield partial(_refused, "Surface", (vertices, broken))
