"""Polylines on all regions: pieces against the rational reference, what is connected, what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Aabb, HalfSpace, LinePieces, Polygon, Solid, Sphere, Triangle, clip_lines, clip_segments
from engine.errors import (
    CancelledError,
    DeadlineExceededError,
    InvalidArrayError,
    NotFiniteError,
    UnsupportedSolidError,
    WrongDimensionError,
)
from engine.running.budget import Budget
from engine.segment_clipping import lines
from engine.segment_clipping.pieces import Pieces
from tests.reference.segments import clip_segments as reference_pieces
from tests.unit.segment_clipping.on_boundary.test_boundary import REGIONS as BOUNDARIES
from tests.unit.segment_clipping.on_boundary.test_boundary import vertices_of
from tests.unit.segment_clipping.scenes import as_json, families
from tests.unit.segment_clipping.test_clip_segments import CORNERS, REGIONS

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]


def reference_lines(lines: Any, region: Solid) -> list[Any]:
    """Return source, positions, and where both ends lie, from the rational pieces of each segment by itself."""
    found = []
    for source, line in enumerate(lines):
        runs: list[list[Any]] = []
        reached = -1
        for segment, piece in reference_pieces([line[k : k + 2] for k in range(len(line) - 1)], as_json(region)):
            part = segment, piece, *piece.rounded()
            if reached == segment - 1 and piece.faces[0] == -1 and runs:
                runs[-1].append(part)
            else:
                runs.append([part])
            reached = segment if piece.faces[1] == -1 else -2
        closes = len(line) > 1 and list(line[0]) == list(line[-1])
        if closes and len(runs) > 1 and runs[0][0][0] == 0 and runs[0][0][1].faces[0] == -1:
            if reached == len(line) - 2:
                runs[-1] += runs.pop(0)
        for run in runs:
            inner = [part[2] for part in run[1:]]
            start, end = run[0][2], run[-1][3]
            faces = (run[0][1].faces[0], run[-1][1].faces[1])
            if faces[0] != -1 and inner and inner[0] == start:
                inner = inner[1:]
            if faces[1] != -1 and inner and inner[-1] == end and len(run) > 1:
                inner = inner[:-1]
            t = run[0][4][0], run[-1][4][1]
            found.append((source, [start, *inner, end], [run[0][0], run[-1][0]], [*t], [*faces]))
    return found


def told(pieces: LinePieces) -> list[Any]:
    columns = (pieces.source, pieces.segments, pieces.t, pieces.faces)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return [(source, pieces[k].tolist(), *rest) for k, (source, *rest) in enumerate(rows)]


def lines_of(rng: np.random.Generator, targets: Any, family: str) -> list[Any]:
    """Return walks over the ends of a family's segments: with repeats, back and forth, some closed."""
    ends = families(rng, targets, 12)[family].reshape(-1, targets.shape[1])
    lines = []
    for size in (0, 2, 3, 5, 8, 8, 8):
        line = ends[np.sort(rng.integers(0, len(ends), size))] if size else ends[:0]
        lines.append(np.concatenate([line, line[:1]]) if rng.random() < 0.6 and size > 1 else line)
    return lines


@pytest.mark.some(10)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kind", [*REGIONS, "boundary"])
@pytest.mark.parametrize("family", ["random", "lattice", "targets", "mixed"])
def test_equals_the_reference(kind: str, dimension: int, family: str, pytestconfig: pytest.Config) -> None:
    rng = np.random.default_rng([dimension, len(kind), len(family)])
    regions = BOUNDARIES[dimension]() if kind == "boundary" else REGIONS[kind](rng, dimension)
    for region in regions:
        targets = vertices_of(region) if kind == "boundary" else CORNERS[dimension]
        for _ in range(20 if pytestconfig.getoption("--full") else 1):
            lines = lines_of(rng, targets, family)
            pieces = clip_lines(lines, region)
            assert told(pieces) == reference_lines([line.tolist() for line in lines], region)
            assert not np.signbit(pieces.vertices[pieces.vertices == 0.0]).any()


def test_what_lies_within_comes_back_as_it_is() -> None:
    line = [[0.1, 0.2], [0.1, 0.2], [0.3, 0.7], [0.1, 0.2], [0.9, 0.9], [0.9, 0.9]]
    pieces = clip_lines([line, line[::-1]], Aabb([0, 0], [1, 1]))
    assert [pieces[0].tolist(), pieces[-1].tolist()] == [line, line[::-1]]
    assert (pieces.segments.tolist(), pieces.t.tolist()) == ([[0, 4]] * 2, [[0, 1]] * 2)
    with pytest.raises(IndexError):
        pieces[2]


def test_a_closed_line_is_one_piece_where_it_closes() -> None:
    pieces = clip_lines([SQUARE, SQUARE[:-1], SQUARE], Aabb([-1, -1], [2, 2]))
    assert pieces.source.tolist() == [0, 1, 2]
    assert [piece.tolist() for piece in pieces] == [
        [[0, 2], [0, 0], [2, 0]],
        [[0, 0], [2, 0]],
        [[0, 2], [0, 0], [2, 0]],
    ]
    assert pieces.segments.tolist() == [[3, 0], [0, 0], [3, 0]]
    inside = clip_lines([SQUARE], Aabb([-1, -1], [5, 5]))
    assert (inside[0].tolist(), inside.faces.tolist()) == (SQUARE, [[-1, -1]])


def test_touching_and_running_along() -> None:
    box = Aabb([0, 0], [2, 2])
    touch, along, corner = [[-1, 1], [0, 1], [-1, 2]], [[-1, 0], [0, 0], [2, 0], [3, 0]], [[-1, 1], [1, 3]]
    pieces = clip_lines([touch, along, corner], box)
    assert told(pieces) == [
        (0, [[0, 1], [0, 1]], [0, 1], [1, 0], [0, 0]),
        (1, [[0, 0], [2, 0]], [0, 2], [1, 0], [0, 1]),
        (2, [[0, 2], [0, 2]], [0, 0], [0.5, 0.5], [0, 3]),
    ]


def test_three_ways_to_give_lines() -> None:
    rng = np.random.default_rng(3)
    lines = rng.uniform(-2, 2, (40, 6, 2))
    expected = told(clip_lines(lines, Sphere([0, 0], 1)))
    ragged = lines.reshape(-1, 2), np.arange(0, 241, 6, dtype=np.int32)
    assert len(expected) > 30
    assert told(clip_lines(lines.tolist(), Sphere([0, 0], 1))) == expected
    assert told(clip_lines(list(lines), Sphere([0, 0], 1))) == expected
    assert told(clip_lines(ragged, Sphere([0, 0], 1))) == expected
    assert [len(clip_lines(none, HalfSpace([1, 0, 0], 0))) for none in ([], np.zeros((0, 4, 3)), [[]])] == [0, 0, 0]
    part = clip_lines((ragged[0], ragged[1][4:9]), Sphere([0, 0], 1))
    assert told(part) == [(source - 4, *rest) for source, *rest in expected if 4 <= source < 8]


def test_report_and_deadline() -> None:
    lines = np.random.default_rng(4).uniform(-2, 2, (100, 7, 2))
    pieces, accuracy = clip_lines(lines, Sphere([0, 0], 1), report=True, workers=1)
    assert (accuracy.n_items, accuracy.decisions, accuracy.coordinates_ulp) == (600, "exact", 0.5)
    assert len(pieces) == len(clip_lines(lines, Sphere([0, 0], 1), deadline=60.0))
    with pytest.raises(DeadlineExceededError):
        clip_lines(lines, Sphere([0, 0], 1), deadline=0.0)


@pytest.mark.parametrize(
    ("lines", "error", "where"),
    [
        ([SQUARE, [[0, 0]]], InvalidArrayError, ("lines", 1)),
        ([SQUARE, [[0, 0], [1, 1, 1]]], WrongDimensionError, ("lines", 1, 1)),
        ([SQUARE, [[0, 0, 0], [1, 1, 1]]], WrongDimensionError, ("lines", 1)),
        ([SQUARE, [[0, 0], [1, float("nan")]]], NotFiniteError, ("lines", 1, 1, 1)),
        ([SQUARE, 7], InvalidArrayError, ("lines", 1)),
        (7, InvalidArrayError, ("lines",)),
        ((np.zeros((4, 2)), np.array([0, 3, 2])), InvalidArrayError, ("lines", 1, 2)),
        ((np.zeros((4, 2)), np.array([0, 5])), InvalidArrayError, ("lines", 1)),
        ((np.zeros((4, 2)), np.array([0.0, 4.0])), InvalidArrayError, ("lines", 1)),
    ],
)
def test_what_is_wrong_is_named(lines: Any, error: Any, where: Any) -> None:
    with pytest.raises(error) as caught:
        clip_lines(lines, Aabb([0, 0], [1, 1]))
    assert caught.value.where == where


def test_other_solids_are_refused() -> None:
    with pytest.raises(UnsupportedSolidError):
        clip_lines([SQUARE], Triangle([[0, 0], [1, 0], [0, 1]]))
    assert len(clip_lines([SQUARE], Polygon([SQUARE[:4]]))) == 1


def test_the_joining_of_pieces_ends_with_the_call() -> None:
    segments, budget = np.tile([[0.0, 0.0], [1.0, 1.0]], (5, 1, 1)), Budget()
    found = clip_segments(segments, Sphere([0.0, 0.0], 9.0))
    pieces = Pieces(found.source, np.stack([found.start, found.end]), found.t, found.faces)
    budget.flag[0] = 1
    with pytest.raises(CancelledError):
        lines._joined(pieces, np.arange(5), np.arange(12.0).reshape(6, 2), np.array([0, 6]), budget)
