"""What an overlay returns: pieces with holes, the exact area, and what rounding did to them."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from engine.arrangement.nodes import nearest_quotient
from engine.arrangement.rings import ExactRings
from engine.errors import NotRepresentableError
from engine.polygon_overlay.implicit_rings import ImplicitRings, edges_along
from engine.running.budget import Budget
from engine.running.parallel import Options
from engine.solids.checks import as_nested_offsets
from engine.solids.columns import ByValue
from engine.solids.pictures import Pictured
from engine.solids.ragged import as_geojson
from engine.types import FloatArray, IntArray


class OverlayOptions(Options, total=False):
    """Keyword options of overlays, besides the common ones."""

    grid: float | None


@functools.lru_cache(64)
def _all_of(n_rings: int) -> IntArray:
    """Return the group offsets of all n_rings as one group: [0, n_rings]; cached."""
    return np.array([0, n_rings])


class OverlayPiece(NamedTuple):
    """One connected part of a result.

    Attributes
    ----------
    shell : ndarray of float64, shape (n, 2)
        Counter-clockwise.
    holes : tuple of ndarray
        Clockwise, each (n, 2).
    """

    shell: FloatArray
    holes: tuple[FloatArray, ...]

    def __repr__(self) -> str:
        return f"<OverlayPiece: {len(self.shell):,} vertices, {len(self.holes):,} hole{'s' * (len(self.holes) != 1)}>"

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The piece as a GeoJSON Polygon, its rings closed."""
        rings = [np.concatenate([ring, ring[:1]]).tolist() for ring in (self.shell, *self.holes)]
        return {"type": "Polygon", "coordinates": rings}


_FEW_VERTICES = 10_000
"""Number of vertices up to which the repr has the area: summing takes milliseconds at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Collapse(ByValue):
    """A part of the exact result that the rounded output no longer has as a part of its own.

    Attributes
    ----------
    kind : {"piece", "hole"}
        A piece goes with its holes.
    area : float
        Of the exact part.
    near : ndarray of float64, shape (2,)
        Its first vertex, rounded.
    """

    kind: Literal["piece", "hole"]
    area: Fraction
    near: tuple[float, float]


Exact = ExactRings | ImplicitRings
_Place = tuple[Fraction, Fraction]


class Lost(NamedTuple):
    """Parts of an exact result that rounding removed. exact: its rings; piece_offsets: of its pieces into rings;
    pieces: the ring numbers of the shells of lost pieces; holes: the ring numbers of lost holes; unit: factor from the
    coordinates of ``exact`` to the caller's."""

    exact: Exact
    piece_offsets: IntArray
    pieces: list[int]
    holes: list[int]
    unit: Fraction = Fraction(1)

    def shells(self) -> list[list[tuple[float, float]]]:
        """Return the shells of lost pieces, as lists of rounded vertices in the coordinates of ``exact``."""
        places = self.exact.some(self.pieces).places()
        return [[(nearest(x), nearest(y)) for x, y in ring] for ring in places]

    def parts(self, budget: Budget) -> tuple[Collapse, ...]:
        """Return the lost pieces, then the lost holes, each sorted lexicographically; raises as `Budget.check`."""
        if not self.pieces and not self.holes:
            return ()
        ends = dict(pairwise(self.piece_offsets.tolist()))
        shell_of = np.repeat(self.piece_offsets[:-1], np.diff(self.piece_offsets)).tolist()
        around = {shell_of[ring] for ring in self.holes}
        if len(around) == 1:  # order: of one shell, which may be large, holes need no more than their own vertices
            around.clear()
        rings = {ring for shell in self.pieces for ring in range(shell, ends[shell])}
        numbers = sorted(rings.union(self.holes, around))
        some = self.exact.some(numbers)
        made = {ring: ExactRings((points,), some.exponent) for ring, points in zip(numbers, some.rings, strict=True)}

        def entry(kind: Literal["piece", "hole"], rings: Sequence[int]) -> tuple[list[_Place], Collapse]:
            budget.check()
            whole = [made[ring] for ring in rings]
            place, (x, y) = _first_vertex(whole[0])
            area = abs(ExactRings(tuple(ring for each in whole for ring in each.rings), whole[0].exponent).area())
            return place, Collapse(kind, area * self.unit**2, (x * float(self.unit), y * float(self.unit)))

        of_shell = {ring: _first_vertex(made[ring])[0] for ring in around}
        pieces = [entry("piece", range(shell, ends[shell])) for shell in self.pieces]
        holes = [(of_shell.get(shell_of[ring], []), *entry("hole", [ring])) for ring in self.holes]
        pieces.sort(key=lambda each: each[0])
        holes.sort(key=lambda each: each[:2])
        return (*(each[-1] for each in pieces), *(each[-1] for each in holes))


def _first_vertex(ring: ExactRings) -> tuple[list[_Place], tuple[float, float]]:
    """Return the vertices of the only ring in `ring`, rotated to begin with the smallest (x, then y), and that vertex
    rounded."""
    (places,) = ring.places()
    k = places.index(min(places))
    x, y = places[k]
    return places[k:] + places[:k], (nearest(x), nearest(y))


def nearest(value: Fraction) -> float:
    """Return the double nearest to a fraction."""
    return nearest_quotient(*value.as_integer_ratio())


@dataclass(frozen=True, repr=False, eq=False)
class Overlay(Pictured, ByValue):
    """The result of a Boolean operation on polygons.

    Attributes
    ----------
    vertices : ndarray of float64, shape (n_vertices, 2)
        All rings one after another, none repeating its first vertex at its end.
    ring_offsets : ndarray of int64, shape (n_rings + 1,)
        Into `vertices`. Each ring begins at its leftmost, then lowest vertex.
    piece_offsets : ndarray of int64, shape (n_pieces + 1,)
        Into the rings; the first ring of a piece is its shell, counter-clockwise, the others its holes, clockwise.
        Pieces and holes are in lexicographic order.
    n_pieces_exact, n_holes_exact : int
        How many the exact result has, before rounding.
    pieces_joined, holes_joined : int
        By how many the count fell because parts closer than rounding grew together.
    pieces_parted, holes_parted : int
        By how many it rose because parts fell apart, or rounding enclosed a new hole. Always n_pieces = n_pieces_exact
        - collapsed pieces - pieces_joined + pieces_parted; likewise for holes.
    rounds : int
        How often the rings were rounded; 0 where every vertex of the exact result is a double.
    vertices_moved : int
        Output vertices that are not the correctly rounded image of a vertex of the exact result.
    largest_displacement : float
        Proven bound on the distance between an edge of the exact result and its image.
    snapped : bool
        The coarser lattice of snap rounding was needed.
    collapsed : tuple of Collapse
        Parts that rounding left nothing of.
    exact : ExactRings
        The rings of the exact result, from which `area_exact` and `area` are computed on request.

    Notes
    -----
    Private fields:

    | field | contents |
    | --- | --- |
    | `_later` | makes fields that are not computed yet (run.py); missing: all are computed |
    | `_lost` | what `collapsed` is made of on request; None where rounding lost nothing |
    | `_edges` | by vertex the input edge of the output edge that begins there, by its first vertex; or sources |
    | `_starts` | the first vertex of each input but the first, all inputs one after another; None: that of the clip |
    """

    vertices: FloatArray
    ring_offsets: IntArray
    piece_offsets: IntArray
    n_pieces_exact: int
    n_holes_exact: int
    exact: Exact
    _lost: Lost | None = field(default=None, repr=False)
    _edges: npt.NDArray[np.signedinteger] | None = field(default=None, repr=False)
    _starts: IntArray | None = field(default=None, repr=False)
    largest_displacement: float = 0.0
    rounds: int = 0
    pieces_joined: int = 0
    pieces_parted: int = 0
    holes_joined: int = 0
    holes_parted: int = 0
    vertices_moved: int = 0
    snapped: bool = False

    def __repr__(self) -> str:
        counts = (
            f"{self.n_pieces:,} piece{'s' * (self.n_pieces != 1)}, {self.n_holes:,} hole{'s' * (self.n_holes != 1)}"
        )
        size = f"{len(self.vertices):,} vertices"
        if len(self.vertices) <= _FEW_VERTICES:
            with suppress(NotRepresentableError):
                size = f"area {self.area:.6g}"
        return f"<Overlay: {counts}, {size}>"

    def __getattr__(self, name: str) -> Any:
        """Return a field that is computed on first access; only missing attributes come here."""
        later = vars(self).get("_later")
        made = {} if later is None or name.startswith("__") else later()
        if name not in made:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        vars(self).update(made)
        return made[name]

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the fields from a pickle, checked: kernels trust offsets."""
        vars(self).update(state)
        as_nested_offsets(len(self.vertices), ring_offsets=self.ring_offsets, piece_offsets=self.piece_offsets)
        if isinstance(self.exact, ImplicitRings):
            self.exact.check()

    def __dir__(self) -> Iterable[str]:
        """List also the fields that are not computed yet."""
        return {*super().__dir__(), *self.__dataclass_fields__}

    @property
    def n_pieces(self) -> int:
        """Number of pieces in the output."""
        return len(self.piece_offsets) - 1

    @property
    def n_holes(self) -> int:
        """Number of holes in the output."""
        return len(self.ring_offsets) - len(self.piece_offsets)

    @functools.cached_property
    def collapsed(self) -> tuple[Collapse, ...]:
        """Parts of the exact result that are lost to rounding, with exact areas."""
        return () if self._lost is None else self._lost.parts(Budget())

    @property
    def rings(self) -> list[FloatArray]:
        """All rings, views of `vertices`."""
        return [self.vertices[start:stop] for start, stop in zip(self.ring_offsets, self.ring_offsets[1:])]

    @property
    def pieces(self) -> list[OverlayPiece]:
        """Shell and holes of each piece, views of `vertices`."""
        rings = self.rings
        return [
            OverlayPiece(rings[start], tuple(rings[start + 1 : stop]))
            for start, stop in zip(self.piece_offsets, self.piece_offsets[1:])
        ]

    @property
    def sources(self) -> IntArray:
        """Which input each edge comes from, shape (n_vertices,): entry k of the edge from vertex k to the next of its
        ring.

        0 is the subject, 1 the clip; of `union_all` the place in its list. Where several inputs share an edge, the
        first of them; where one output edge is several of the input in line, the one that it begins with.
        """
        exact = self.exact
        edges, starts = self._edges, self._starts
        if isinstance(exact, ImplicitRings):
            edges = exact.sources if edges is None else edges
            starts = np.array([len(exact.subject.vertices)]) if starts is None else starts
        assert edges is not None
        assert starts is not None
        return np.searchsorted(starts, edges_along(edges) if edges.ndim == 2 else edges, side="right")

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The pieces as a GeoJSON Polygon or MultiPolygon."""
        return as_geojson(self.vertices, self.ring_offsets, self.piece_offsets)

    @property
    def area_exact(self) -> Fraction:
        """The exact area of the exact result, a fraction whose length grows with all its crossings: costly for
        thousands."""
        return self.exact.exact_rings().area()

    @property
    def area(self) -> float:
        """The double nearest to `area_exact`: a bound proves it, or the exact sum; no fraction is made. Raises
        `NotRepresentableError` beyond the largest double."""
        return self.exact.nearest_areas(_all_of(self.exact.n_rings)).item(0)

    @property
    def piece_areas(self) -> FloatArray:
        """Areas of the pieces of the exact result, holes subtracted: (n_pieces_exact,), the nearest doubles. Where
        rounding lost, joined or parted none these are those of `pieces`, in their order."""
        return self.exact.nearest_areas(np.append(np.flatnonzero(self.exact.are_shells()), self.exact.n_rings))


def build_overlay(
    vertices: FloatArray, ring_offsets: IntArray, piece_offsets: IntArray, exact: Exact, **fields: Any
) -> Overlay:
    """Make an `Overlay` of read-only arrays; fields: others of its fields. If n_pieces_exact is missing there, the
    exact result has as many pieces and holes as the arrays."""
    fields.update(vertices=vertices, ring_offsets=ring_offsets, piece_offsets=piece_offsets, exact=exact)
    if "n_pieces_exact" not in fields:
        fields["n_pieces_exact"], fields["n_holes_exact"] = (
            len(piece_offsets) - 1,
            len(ring_offsets) - len(piece_offsets),
        )
    result = object.__new__(Overlay)
    object.__setattr__(result, "__dict__", fields)  # Overlay(...) sets fields one by one, which takes 2 us
    return result
