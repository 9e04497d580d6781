"""Answers of collision and clearance, and the options of one pair.

Every pair of types has one function ``(first, second, poses, work) -> Collision``, listed in `collide.py`. `Work`
carries its budget, its options and its counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from engine.running.budget import UNLIMITED, Budget
from engine.solids.base import Solid
from engine.solids.columns import ByValue
from engine.solids.pose import Pose
from engine.solids.registry import row_of
from engine.types import FloatArray, Rcc8, Relation

Kind = Literal[
    "vertex_vertex", "vertex_edge", "vertex_face", "edge_edge", "edge_face", "face_face", "containment", "surface"
]
"""The features of the two faces that meet; `containment` where a body, or a part of it, lies inside the other without
contact. Edges are those of the triangles that a face was cut into; `surface` where a body has none."""


Poses = tuple[Pose | None, Pose | None]
"""Poses of two bodies, None for the identity."""
Containing = Literal["", "first", "second"]

_SWAPPED: dict[Containing, Containing] = {"": "", "first": "second", "second": "first"}
_IN, _AROUND = Relation.FIRST_INSIDE_SECOND, Relation.SECOND_INSIDE_FIRST
SWAPPED_RELATION = {_IN: _AROUND, _AROUND: _IN}


@dataclass(frozen=True, slots=True)
class Witness:
    """One reason why two bodies have a common point.

    Of bodies that touch it is the strongest contact, of equal ones that of the lowest faces: of all where a plane of a
    face parts the bodies, else of some 32. Where both bodies lie in one plane it is any of their contacts, and may
    change with the order of the faces.

    Attributes
    ----------
    kind : str
        How the two faces meet, or `containment`.
    first_face, second_face : int
        The caller's face of each body (aabb: 0..5 = xmin, xmax, ymin, ymax, zmin, zmax), -1 where the body has no faces
        or the witness is a containment and this body is the one that contains; -1 for both in a containment of boxes,
        or of outlines of the plane.
    containing : str
        For `containment` the body that contains, else "".
    piercing : bool
        Touching only: some point of one body lies in the open interior of the other, although the open interiors do not
        meet (a surface, a flat body, or a wall that cancels).
    """

    kind: Kind
    first_face: int = -1
    second_face: int = -1
    containing: Containing = ""
    piercing: bool = False


@dataclass(frozen=True, slots=True)
class Collision:
    """How two bodies relate.

    Attributes
    ----------
    relation : Relation
        Disjoint, touching, overlapping, or one inside the other.
    witness : Witness or None
        What proves it; None when they are disjoint, or where none was asked for.
    detail : Rcc8 or None
        The relation of RCC-8, where asked for; None where a body has no interior.
    """

    relation: Relation
    witness: Witness | None = None
    detail: Rcc8 | None = None

    def __repr__(self) -> str:
        w, parts = self.witness, [self.relation.label]
        parts += [] if w is None else [" ".join([w.kind, *(str(f) for f in (w.first_face, w.second_face) if f >= 0)])]
        return f"<Collision: {', '.join(parts + ([] if self.detail is None else [self.detail.label]))}>"

    @property
    def collides(self) -> bool:
        """Whether the bodies have a common point; so is the result itself, as a condition."""
        return self.relation != Relation.DISJOINT

    def __bool__(self) -> bool:
        return self.collides

    def swapped(self) -> Collision:
        """Return the answer for the two bodies in the other order.

        Returns
        -------
        Collision
            Relation, witness and detail are those of the second to the first.
        """
        w, detail = self.witness, None if self.detail is None else self.detail.swapped
        if w is not None:
            w = Witness(w.kind, w.second_face, w.first_face, _SWAPPED[w.containing], w.piercing)
        return Collision(SWAPPED_RELATION.get(self.relation, self.relation), w, detail)


class PoseRelations(np.ndarray[Any, np.dtype[np.int8]]):
    """An array of codes of `Relation`, one a pose."""

    @property
    def first_contact(self) -> int | None:
        """The number of the first pose in which the bodies meet, None if they never do."""
        met = np.flatnonzero(np.asarray(self) != Relation.DISJOINT)
        return int(met[0]) if len(met) else None


FACES = {3: ("mesh", "box"), 2: ("outline", "box")}
"""Kinds of `Row.meets` that have faces, or in the plane edges, by dimension."""
BODIES = [(d, kind) for d, kinds in FACES.items() for kind in kinds]


def meets_as(solid: Solid) -> str:
    """Return the kind (mesh, outline, box, sphere, half_space) by which a solid is looked up in the table of pairs, ""
    if collision does not support it."""
    return row_of(solid).meets.get(solid.dimension, "")


def has_faces(solid: Solid) -> bool:
    """Return whether witnesses name a face of the solid (in the plane, an edge)."""
    return meets_as(solid) in FACES[solid.dimension]


RELATIONS = tuple(Relation)
UNNAMED = tuple(map(Collision, RELATIONS))
"""By relation, the answer without a witness."""
NO_CONTACT = UNNAMED[Relation.DISJOINT]
FIRST_WITHIN = Collision(Relation.FIRST_INSIDE_SECOND, Witness("containment", containing="second"))
SECOND_WITHIN = Collision(Relation.SECOND_INSIDE_FIRST, Witness("containment", containing="first"))
OVERLAP, TOUCH = Collision(Relation.OVERLAPPING, Witness("surface")), Collision(Relation.TOUCHING, Witness("surface"))
"""Answers for pairs of bodies without faces."""


class Parts(NamedTuple):
    """Which of two overlapping bodies has a part outside the other. first, second: whether that body's open interior
    has points outside the other. meet: whether the boundaries meet."""

    first: bool
    second: bool
    meet: bool

    def swapped(self) -> Parts:
        """Return the parts for the two bodies in the other order."""
        return Parts(self.second, self.first, self.meet)


@dataclass(slots=True)
class Work:
    """Budget, options and counts of pairs decided one after the other.

    | field | meaning |
    |---|---|
    | budget | poll `budget.check()` in slow loops; kernels poll `budget.flag` |
    | witness | False if only the relation is wanted |
    | boolean | True if only disjoint or not is wanted: any other relation may be reported as touching |
    | n_beyond_filter, n_rational | decisions of this pair (faces, points) left open by the filter, by the kernel |
    | items | number of pairs with such decisions: beyond the filter, rational |
    """

    budget: Budget = field(default_factory=Budget)
    witness: bool = True
    boolean: bool = False
    n_beyond_filter: int = 0
    n_rational: int = 0
    items: tuple[int, int] = (0, 0)

    def end_item(self) -> None:
        """Count the pair that was decided, and begin with the next."""
        beyond, rational = self.items
        self.items = beyond + (self.n_beyond_filter > 0), rational + (self.n_rational > 0)
        self.n_beyond_filter = self.n_rational = 0


UNCOUNTED = {(named, boolean): Work(UNLIMITED, named, boolean) for named in (False, True) for boolean in (False, True)}
"""Work of calls without deadline and report, by `witness` and `boolean`; nobody reads its counts."""

PairFunction = Callable[[Any, Any, Poses, Work], Collision]
PartsFunction = Callable[[Any, Any, Poses, Work], Parts]
"""The types of the two solids are those of the table in `collide.py`."""


class Feature(NamedTuple):
    """What of a body the nearest point lies on.

    Attributes
    ----------
    kind : str
        vertex, edge or face; ball; plane (of a half_space).
    indices : tuple of int
        Of a vertex one index, of an edge two, the smaller first, of a face its own; none of a ball or a plane.

    Notes
    -----
    Vertices are numbered as given (polygon: over all rings; aabb: bit k of a corner's number is 0 for low, 1 for high
    on axis k), of several at one position the first; aabb faces are 0..5 = xmin, xmax, ymin, ymax, zmin, zmax. What
    lies inside a face is on it, whatever it was cut into.
    """

    kind: Literal["vertex", "edge", "face", "ball", "plane"]
    indices: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Clearance(ByValue):
    """How far apart two bodies are.

    Attributes
    ----------
    distance : float
        The double nearest to the exact distance; 0.0 exactly where they have a common point.
    points : ndarray of float64, shape (2, d), or None
        A point of each at that distance; None where they have a common point.
    features : tuple of Feature, or None
        What these points lie on.
    """

    distance: float
    points: FloatArray | None = None
    features: tuple[Feature, Feature] | None = None

    def __repr__(self) -> str:
        named = [" ".join(map(str, (each.kind, *each.indices))) for each in self.features or ()]
        return f"<Clearance: {', '.join([repr(float(self.distance)), ' to '.join(named)][: 1 + bool(named)])}>"
