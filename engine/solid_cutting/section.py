"""Public: the sections of a solid by planes, as polygons with holes."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, ClassVar, Final, cast

import numpy as np

from engine.errors import InvalidArrayError, InvalidInputError, UnsupportedSolidError, ZeroNormalError
from engine.predicates.rational import cross, dot, squared_length
from engine.running.budget import Budget, Cancel, current, polled
from engine.running.parallel import Progress, check_options
from engine.solid_cutting.caps import Area, Seen
from engine.solid_cutting.cut_measures import area_of_section
from engine.solid_cutting.exact_measures import nearest_root_over
from engine.solid_cutting.plane_cut import Plane, plane_of, plane_through
from engine.solid_cutting.slices import slices_at
from engine.solids.accepted import SolidLike
from engine.solids.base import Solid, named
from engine.solids.checks import as_floats, as_vector, shown
from engine.solids.mesh import Polyhedron
from engine.solids.polygon import Polygon
from engine.solids.primitives import HalfSpace
from engine.solids.ragged import Ragged, summed
from engine.solids.registry import kind_of
from engine.solids.shapes import read_argument
from engine.types import Accuracy, FloatArray, IntArray, read_only

_NO_HEIGHTS: Final = np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sections(Ragged):
    """The sections of a solid by planes, as flat arrays.

    Attributes
    ----------
    vertices : ndarray of float64, shape (n_vertices, 3)
        In space, all rings one after another; each coordinate the nearest double.
    ring_offsets : ndarray of int64, shape (n_rings + 1,)
        Into `vertices`. Rings begin at a leftmost vertex, and run counter-clockwise about what is inside, seen against
        the normal of the plane.
    piece_offsets : ndarray of int64, shape (n_pieces + 1,)
        Into the rings; the first ring of a piece is its shell, the others its holes.
    plane_offsets : ndarray of int64, shape (n_planes + 1,)
        Into the pieces.
    """

    _rows: ClassVar[str] = "planes"
    _levels: ClassVar[tuple[str, ...]] = ("vertices", "ring_offsets", "piece_offsets", "plane_offsets")
    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    plane_offsets: IntArray
    _exact: tuple[tuple[Seen, Plane, list[Area]], ...] = field(repr=False, default=())
    _areas: FloatArray | None = field(repr=False, default=None)

    _flat: FloatArray | None = field(repr=False, default=None)

    def __len__(self) -> int:
        return len(self.plane_offsets) - 1

    def __reduce__(self) -> tuple[Any, ...]:
        offsets = self.ring_offsets, self.piece_offsets, self.plane_offsets
        return type(self)._restored, (self.vertices, *offsets, (), self.areas, self.flat)

    @property
    def areas(self) -> FloatArray:
        """The doubles nearest to the exact areas of all pieces, (n_pieces,), computed when asked for."""
        if self._areas is None:
            object.__setattr__(self, "_areas", _areas_of(self._exact, current()))
        return cast("FloatArray", self._areas)

    @property
    def flat(self) -> FloatArray:
        """The vertices in the coordinates of their planes, (n_vertices, 2), the nearest doubles, computed when asked
        for.

        The first axis of a plane is the projection onto it of an axis of space: the one after the axis along which the
        normal is largest, or the next but one if that component is negative. The second is at a right angle to the
        left, seen against the normal; the origin is that of space, projected. So a section at a height has x and y.
        """
        if self._flat is None:
            rows = [_flat(view, plane, number) for view, plane, some in self._exact for area in some
                    for ring in (area.shell, *area.holes) for number in polled(ring)]  # fmt: skip
            object.__setattr__(self, "_flat", read_only(np.array(rows, np.float64).reshape(-1, 2)))
        return cast("FloatArray", self._flat)

    def polygons(self, plane: int) -> list[Polygon]:
        """Return the pieces of a plane as polygons in its coordinates.

        Parameters
        ----------
        plane : int
            Number of the plane.

        Returns
        -------
        list of Polygon
            With holes.

        Raises
        ------
        IndexError
            There is no such plane.
        """
        if not 0 <= plane < len(self):
            raise IndexError(f"there are {len(self)} planes, got number {plane}")
        pieces, rings = self.plane_offsets[plane : plane + 2], self.ring_offsets.tolist()
        bounds = self.piece_offsets[int(pieces[0]) : int(pieces[1]) + 1].tolist()
        return [Polygon([self.flat[rings[k] : rings[k + 1]] for k in range(*ends)]) for ends in pairwise(bounds)]


def section(
    solid: SolidLike,
    planes: Any,
    *,
    normal: Any = None,
    measures: bool = False,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> Sections | tuple[Sections, Accuracy]:
    """Return the sections of a polyhedron by one or many planes, as polygons with holes.

    Parameters
    ----------
    solid : Solid
        A polyhedron.
    planes : HalfSpace, list of HalfSpace, or array_like
        The planes of half-spaces; an array (2, 3), a point and a normal; (3, 3), three points, through which it passes
        exactly; or (n,), heights: the planes ``dot(normal, p) = height``.
    normal : array_like, shape (3,), optional
        Of heights; z by default.
    measures : bool, default False
        Compute `areas` in this call, within its deadline.
    workers : int, optional
        One is used.
    deadline, cancel, report
        As for `locate`.
    progress : callable, optional
        Called with 1 for each plane.

    Returns
    -------
    Sections
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    UnsupportedSolidError
        Any solid but a polyhedron.
    InvalidInputError
        Faces of the polyhedron cross; the message names two.
    InvalidArrayError, NotFiniteError, ZeroNormalError, WrongDimensionError
        The planes break a rule; three points on a line have no plane.
    TooComplexError
        Rings of a section cross each other.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Boundary: a vertex on the plane counts as on the side to which the normal does not point, so the section is that of
    the plane moved along its normal by less than anything. Where a face lies in the plane it is in the section if the
    solid is on the side of the normal. What has no area, where the plane touches an edge or vertex, is left out.

    Degenerate input: a polyhedron is even-odd, see `volume`; rings may touch themselves and each other.

    Accuracy: which rings there are, and their order, is exact; coordinates are the nearest doubles, so that a vertex
    may lie half a unit in the last place off the plane, and neighbours may round to one position.

    Cost: some 0.05 us a face for one plane; of many parallel ones each looks at the faces that reach it alone. What
    `volume` computes once is needed here too.

    References
    ----------
    Weiler, Atherton, Hidden surface removal using polygon area sorting, 1977.

    Examples
    --------
    >>> from engine import Polyhedron
    >>> corners = [[x, y, z] for z in (0, 1) for y in (0, 2) for x in (0, 3)]
    >>> quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    >>> box = section(Polyhedron(corners, quads), [0.0, 0.5, 1.0])
    >>> box.areas.tolist(), box.plane_offsets.tolist()
    ([6.0, 6.0], [0, 1, 2, 2])
    """
    body, deadline = as_polyhedron(solid, "section", deadline, cancel)
    check_options(workers, progress, report=report, measures=measures)
    with Budget(deadline, cancel, workers) as budget, np.errstate(all="ignore"):
        budget.check()
        rows, axis, heights = _rows_of(planes, normal, budget)
        made = slices_at(body, rows, axis, heights, budget)
        for _ in made if progress is not None else ():
            progress(1)  # type: ignore[misc]
        result = _sections(made, measures, budget)
    n = len(made)
    return (
        (result, Accuracy("exact", 0.5, n, 0, 0, "plane_sweep" if axis is not None else "plane")) if report else result
    )


def as_polyhedron(
    solid: Any, what: str, deadline: float | None, cancel: Cancel | None
) -> tuple[Polyhedron, float | None]:
    """Return a polyhedron as it is, or made of what people hold, and the rest of the deadline."""
    solid, deadline = read_argument(solid, deadline, cancel)
    if not isinstance(solid, Polyhedron):
        more = "; clip_polygons and overlay cut polygons of the plane" if getattr(solid, "dimension", 3) == 2 else ""
        raise UnsupportedSolidError(
            f"{what} does not take {named(kind_of(solid))}; give a polyhedron{more}", ("solid",)
        )
    return solid, deadline


def _rows_of(planes: Any, normal: Any, budget: Budget) -> tuple[list[Plane], FloatArray | None, FloatArray]:
    """Return the planes of an argument, and the normal of heights, and heights."""
    listed = [planes] if isinstance(planes, HalfSpace) else planes
    if isinstance(listed, (list, tuple)) and any(isinstance(each, Solid) for each in listed):
        for number, each in enumerate(listed):
            if not isinstance(each, HalfSpace) or each.dimension != 3:
                raise InvalidArrayError(
                    f"planes[{number}] must be a half-space of space, got {shown(each)}", ("planes", number)
                )
        if normal is not None:
            raise InvalidInputError("normal goes with heights; leave it out", ("normal",))
        return [plane_of(each.row.tolist()) for each in listed], None, _NO_HEIGHTS
    try:
        depth = np.ndim(planes)
    except (ValueError, TypeError):
        depth = -1
    if depth == 1:
        heights = as_floats(planes, 1, ("planes",))
        axis = as_vector([0, 0, 1] if normal is None else normal, 3, ("normal",))
        if not axis.any():
            raise ZeroNormalError("normal is zero; give the direction of the heights", ("normal",))
        rows = []
        for height in heights.tolist():
            budget.check()
            rows.append(plane_of([*axis.tolist(), -height]))
        return rows, read_only(axis), heights
    values = as_floats(planes, 2, ("planes",)) if depth == 2 else None
    if values is None or values.shape[1] != 3 or len(values) not in (2, 3):
        raise InvalidArrayError(
            "planes must be half-spaces, a point and a normal (2, 3), three points (3, 3), or heights (n,), got "
            f"{shown(planes)}",
            ("planes",),
        )
    if normal is not None:
        raise InvalidInputError("normal goes with heights; leave it out", ("normal",))
    plane = plane_through(values)
    if not any(plane.integers[:3]):
        what = "the normal is zero" if len(values) == 2 else "the three points are on one line"
        raise ZeroNormalError(f"{what}; give another plane", ("planes",))
    return [plane], None, _NO_HEIGHTS


def _areas_of(made: Any, budget: Budget) -> FloatArray:
    rows = [area_of_section(view, plane, area, budget) for view, plane, areas in made for area in areas]
    return np.array(rows, np.float64)


def _sections(made: list[tuple[Seen, Plane, list[Area]]], measures: bool, budget: Budget) -> Sections:
    rings, sizes, counts = [np.zeros((0, 3))], [], []
    for view, _, areas in made:
        budget.check()
        areas.sort(key=lambda area: tuple(view.points.rounded(area.shell[:1])[0].tolist()))
        for area in areas:
            sizes.append(1 + len(area.holes))
            rings += [view.points.rounded(np.array(ring, np.int64)) for ring in (area.shell, *area.holes)]
    counts = [len(areas) for _, _, areas in made]
    areas_made = _areas_of(made, budget) if measures else None
    offsets = summed([len(ring) for ring in rings[1:]])
    return Sections(read_only(np.concatenate(rings)), offsets, summed(sizes), summed(counts), tuple(made), areas_made)


def join_sections(parts: list[Sections]) -> Sections:
    """Return the sections of some calls as those of one."""
    names = ("ring_offsets", "piece_offsets", "plane_offsets")
    rings, pieces, planes = (summed(np.concatenate([np.diff(getattr(each, name)) for each in parts])) for name in names)
    vertices, areas, flat = (
        read_only(np.concatenate([getattr(each, name) for each in parts])) for name in ("vertices", "areas", "flat")
    )
    return Sections(vertices, rings, pieces, planes, (), areas, flat)


def _flat(view: Seen, plane: Plane, number: int) -> tuple[float, float]:
    """Return the nearest doubles of a point's coordinates in a plane, see `Sections.flat`."""
    normal, offset = plane.integers[:3], plane.integers[3]
    place, i = view.points.exact(number), view.axes[0]
    if sum(x != 0 for x in normal) == 1:
        return tuple((view.points.rounded([number])[0, list(view.axes)]).tolist())
    square, w = squared_length(normal), place[3]
    rest = square - normal[i] ** 2
    first = square * place[i] + normal[i] * offset * w
    along = tuple(int(k == i) for k in range(3))
    second = dot(cross(normal, along), place[:3])
    return (nearest_root_over(first, square * rest, square * rest * w), nearest_root_over(second, rest, rest * w))
