"""The parts of lines outside a region: what the pieces within it leave, ends included."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import Aabb, InvalidInputError, LinePieces, Polygon, Sphere, clip_lines

BOX = Aabb((0, 0), (4, 4))
AROUND = [(-1, -1), (5, -1), (5, 5), (-1, 5), (-1, -1)]


def outside(line: Any, region: Any = BOX) -> list[Any]:
    return [
        part.tolist()
        for part in (lambda made: [made[k] for k in range(len(made))])(clip_lines([line], region, keep="outside"))
    ]


@pytest.mark.parametrize(("line", "parts"), [
    ([(-1, 2), (5, 2)], [[[-1, 2], [0, 2]], [[4, 2], [5, 2]]]),
    ([(1, 1), (2, 2)], []),
    ([(0, 0), (4, 0)], []),  # along the boundary
    ([(5, 5), (6, 6), (7, 5)], [[[5, 5], [6, 6], [7, 5]]]),
    ([(-1, 1), (0, 2), (-1, 3)], [[[-1, 1], [0, 2]], [[0, 2], [-1, 3]]]),  # touches at a vertex of the line
    ([(-2, 2), (2, 6)], [[[-2, 2], [0, 4]], [[0, 4], [2, 6]]]),  # touches at a corner of the box
    ([(2, 2), (6, 2), (6, 3), (2, 3)], [[[4, 2], [6, 2], [6, 3], [4, 3]]]),
    ([(4, 2), (6, 2)], [[[4, 2], [6, 2]]]),  # begins on the boundary
    (AROUND, [AROUND]),
    ([(6, 2), (2, 2), (2, 3), (6, 3), (6, 2)], [[[4, 3], [6, 3], [6, 2], [4, 2]]]),  # closes outside: one part
    ([(2, 2), (6, 2), (6, 3), (2, 3), (2, 2)], [[[4, 2], [6, 2], [6, 3], [4, 3]]]),  # closes inside
    ([(1, 1), (1, 1)], []),
    ([(9, 9), (9, 9)], [[[9, 9], [9, 9]]]),
])  # fmt: skip
def test_what_the_pieces_leave(line: Any, parts: list[Any]) -> None:
    assert outside(line) == [[[*map(float, at)] for at in part] for part in parts]


def marks(made: LinePieces, k: int) -> list[tuple[int, float]]:
    return list(zip(made.segments[k].tolist(), made.t[k].tolist(), strict=True))


@pytest.mark.parametrize("seed", range(10))
def test_pieces_and_parts_make_up_the_line(seed: int) -> None:
    """Along an open line ends of pieces and of parts follow each other without a gap, each from the one before."""
    draw = np.random.default_rng(seed)
    region: Any = [
        BOX,
        Sphere((2, 2), 2),
        Polygon([[(0, 0), (4, 0), (2, 1), (4, 4), (0, 4)], [(1, 1), (2, 3), (3, 3)]]),
    ][seed % 3]
    lines = [draw.integers(-3, 8, (draw.integers(2, 12), 2)) / draw.choice([1.0, 3.0]) for _ in range(40)]
    lines = [line for line in lines if (line[0] != line[-1]).any()]
    inside, rest = clip_lines(lines, region), clip_lines(lines, region, keep="outside")
    for k, line in enumerate(lines):
        ends = [(marks(made, i), made[i]) for made in (inside, rest) for i in np.flatnonzero(made.source == k).tolist()]
        ends.sort(key=lambda end: end[0])
        places = [at for _, chain in ends for at in (chain[0].tolist(), chain[-1].tolist())]
        assert places[0] == line[0].tolist()
        assert places[-1] == line[-1].tolist()
        assert places[1:-1:2] == places[2::2]
        walked = [at.tolist() for _, chain in ends for at in chain]
        assert all(vertex.tolist() in walked for vertex in line)


def test_columns_of_many_lines_and_options() -> None:
    made = clip_lines([[(-1, 2), (5, 2)], np.zeros((0, 2)), [(5, 5), (6, 6)]], BOX, keep="outside", deadline=60.0)
    assert made.source.tolist() == [0, 0, 2]
    assert made.faces.tolist() == [[-1, 0], [1, -1], [-1, -1]]
    assert made.segments.tolist() == [[0, 0]] * 3
    assert len(clip_lines([], BOX, keep="outside")) == 0
    _, accuracy = clip_lines([AROUND], BOX, keep="outside", report=True)
    assert accuracy.n_items == 4
    with pytest.raises(InvalidInputError, match="keep must be inside or outside"):
        clip_lines([AROUND], BOX, keep="both")  # type: ignore[arg-type]
