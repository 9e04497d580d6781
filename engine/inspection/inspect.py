"""Public: what keeps a mesh from being a closed solid, each thing with its places, and the mends by option."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from engine.distance.clearance import checked_distance
from engine.errors import InvalidArrayError, InvalidInputError
from engine.files.meshes import read_mesh
from engine.inspection.mends import filled, nesting, oriented, welded
from engine.running.budget import Budget, Cancel
from engine.solid_cutting.faults import are_flat, crossings, edges_of, junctions, shells_of
from engine.solids.accepted import SolidLike
from engine.solids.checks import as_points, shown
from engine.solids.columns import ByValue
from engine.solids.mesh import Mesh, Polyhedron, Surface, as_faces, first_equal
from engine.solids.shapes import mesh_arrays_of
from engine.types import FloatArray, IntArray

_PACKED: Final = 1 << 21
"""Number of vertices below which the three corners of a face fit into one int64."""
_MENDS: Final = {
    "open_edges": "close the mesh there; weld= closes gaps narrower than a distance, fill_t_junctions= splits edges",
    "turned_edges": "turn the faces that run the wrong way; orient=True does it where the mesh is closed",
    "t_junctions": "split the edge at the vertex: fill_t_junctions=True does it",
    "duplicate_faces": "leave one of the two out",
    "flat_faces": "those that name a vertex twice are refused: weld=0.0 leaves them out; others are taken, and bound "
    "nothing",
    "inverted_shells": "turn all faces of the shell: orient=True does it",
    "self_crossings": "the solid is taken, even-odd; a Boolean union in the program that made the mesh removes them",
}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Inspection(ByValue):
    """The faults of a mesh, and the mesh after the mends of the options.

    Attributes
    ----------
    vertices : ndarray of float64, shape (n, 3)
        As given, or after `weld`.
    faces : ndarray of int64, shape (m, 3)
        Triangles: faces of more corners are cut. Numbers of faces below are rows of it.
    open_edges : ndarray of int64, shape (k, 2)
        Edges that an odd number of faces use, by their vertices.
    turned_edges : ndarray of int64, shape (k, 2)
        Other edges that are not used equally often in both directions.
    t_junctions : ndarray of int64, shape (k, 3)
        An open edge, and a vertex of another exactly on it.
    duplicate_faces : ndarray of int64, shape (k, 2)
        A face, and the first with the same vertices.
    flat_faces : ndarray of int64, shape (k,)
        Faces without area.
    inverted_shells : tuple of ndarray of int64
        The faces of each closed shell whose inside is not where nesting puts it.
    self_crossings : ndarray of int64, shape (k, 2)
        Pairs of faces with a common point besides common vertices and edges. Pairs at a T-junction, duplicates and
        faces without area are left out.
    n_shells : int
        How many parts the faces form that hang together by edges.
    mended : tuple of str
        What the options did, a sentence each.
    """

    vertices: FloatArray
    faces: IntArray
    open_edges: IntArray
    turned_edges: IntArray
    t_junctions: IntArray
    duplicate_faces: IntArray
    flat_faces: IntArray
    inverted_shells: tuple[IntArray, ...]
    self_crossings: IntArray
    n_shells: int
    mended: tuple[str, ...] = ()

    def __repr__(self) -> str:
        counted = [
            f"{len(getattr(self, name)):,} {name.replace('_', ' ')}" for name in _MENDS if len(getattr(self, name))
        ]
        text = f"<Inspection: {len(self.faces):,} faces, {', '.join(counted) or 'nothing is wrong'}>"
        return text if len(text) <= 120 else f"<Inspection: {len(self.faces):,} faces, {len(counted)} kinds of faults>"

    @property
    def is_closed(self) -> bool:
        """Whether `Polyhedron` takes the mesh: it has faces, none names a vertex twice, no edge is open or turned."""
        is_sound = len(self.faces) > 0 and not (self.faces == np.roll(self.faces, 1, axis=1)).any()
        return is_sound and not len(self.open_edges) and not len(self.turned_edges)

    @property
    def advice(self) -> dict[str, str]:
        """What would mend each kind of fault, by the name of the field."""
        return {name: words for name, words in _MENDS.items() if len(getattr(self, name))}

    def solid(self) -> Polyhedron:
        """Return the polyhedron of the mesh.

        Returns
        -------
        Polyhedron
            Raises as its constructor where the mesh is not closed.
        """
        return Polyhedron(self.vertices, self.faces)


def inspect(
    mesh: SolidLike | str | os.PathLike[str] | bytes,
    *,
    weld: float | None = None,
    orient: bool = False,
    fill_t_junctions: bool = False,
    deadline: float | None = None,
    cancel: Cancel | None = None,
) -> Inspection:
    """Return what keeps a mesh from being a sound solid: open edges, T-junctions, crossings and more, with places.

    Parameters
    ----------
    mesh : Polyhedron, Surface, a mesh of another package, (vertices, faces), or a file
        Files as `read_mesh` takes them. It need not be closed.
    weld : float, optional
        First make one of vertices that are at most so far apart, and leave out faces that this collapses.
    orient : bool, default False
        Turn faces, so that neighbours run alike, and closed shells outward, cavities inward.
    fill_t_junctions : bool, default False
        Split open edges at the vertices that lie exactly on them.
    deadline, cancel
        As for `locate`.

    Returns
    -------
    Inspection
        Of the mesh after the mends of the options, which `mended` names.

    Raises
    ------
    InvalidArrayError, IndexOutOfRangeError, NotFiniteError, EmptyGeometryError, InvalidInputError
        For arrays and files that are no mesh.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Vertices at equal coordinates count as one. Nothing is changed without an option. Faults are decided exactly;
    `weld` compares distances in floating point, and moves a vertex to the first of those that it is welded to.

    Degenerate input: faces without area, and faces that name a vertex twice, are flat and cross nothing.

    Cost: the pairs of faces whose boxes meet, some 2 us each; a shell within others is located in each of them. The
    deadline is not checked while edges are sorted: about a second for a million faces.

    References
    ----------
    Guigue, Devillers, Fast and robust triangle-triangle overlap test using orientation predicates, 2003.

    Examples
    --------
    >>> from engine import inspect
    >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    >>> report = inspect((corners, [(0, 2, 1), (0, 1, 3), (1, 2, 3)]))
    >>> report, report.open_edges.tolist()
    (<Inspection: 3 faces, 3 open edges>, [[0, 2], [0, 3], [2, 3]])
    """
    for name, option in (("orient", orient), ("fill_t_junctions", fill_t_junctions)):
        if not isinstance(option, (bool, np.bool_)):
            raise InvalidInputError(f"{name} must be True or False, got {shown(option)}", (name,))
    with Budget(deadline, cancel) as budget:
        budget.check()
        points, faces = _arrays_of(mesh)
        mended: list[str] = []
        if weld is not None:
            points, faces = welded(points, faces, checked_distance(weld, "weld"), budget, mended)
        if fill_t_junctions:
            faces = filled(points, faces, budget, mended)
        if orient:
            faces = oriented(points, faces, budget, mended)
        return _inspected(points, faces, budget, tuple(mended))


def _arrays_of(mesh: Any) -> tuple[FloatArray, IntArray]:
    """Return vertices and triangles; of vertices at equal coordinates the first is named."""
    if isinstance(mesh, (str, bytes, os.PathLike)):
        mesh = read_mesh(mesh)
    if isinstance(mesh, Mesh):
        return mesh.vertices, mesh.triangles
    given = mesh if isinstance(mesh, (tuple, list)) else mesh_arrays_of(mesh)
    if given is None or len(given) != 2:
        raise InvalidArrayError(
            f"mesh must be a mesh, (vertices, faces) or the path of a file, got {shown(mesh)}", ("mesh",)
        )
    points = as_points(given[0], 3, ("vertices",)) + 0.0
    offsets, indices = as_faces(given[1], len(points))
    if offsets is not None:
        surface = Surface(points, given[1])
        return surface.vertices, surface.triangles
    first = first_equal(points)
    return points, (indices if first is None else first[indices]).reshape(-1, 3)


def _inspected(points: FloatArray, faces: IntArray, budget: Budget, mended: tuple[str, ...]) -> Inspection:
    edges = edges_of(faces)
    budget.check()
    is_open, is_flat = edges.uses % 2 == 1, are_flat(points, faces, budget)
    rows, n = np.sort(faces, axis=1), len(points)
    budget.check()
    keys: Any = (rows[:, 0] * n + rows[:, 1]) * n + rows[:, 2] if n < _PACKED else rows
    _, firsts, which = np.unique(keys, axis=None if n < _PACKED else 0, return_index=True, return_inverse=True)
    budget.check()
    first = firsts[which.reshape(-1)]
    copies = np.flatnonzero(first != np.arange(len(faces)))
    at_edges = junctions(points, edges.ends[is_open], budget)
    shells = shells_of(edges, budget)
    inverted = [shell for shell, is_turned in nesting(points, faces, shells, budget) if is_turned]
    solid_faces = np.setdiff1d(np.flatnonzero(~is_flat), copies)
    return Inspection(
        points, faces, edges.ends[is_open], edges.ends[~is_open & (edges.net != 0)], at_edges,
        np.stack([copies, first[copies]], axis=1), np.flatnonzero(is_flat), tuple(inverted),
        crossings(points, faces, solid_faces, at_edges, budget), len(shells), mended,
    )  # fmt: skip
