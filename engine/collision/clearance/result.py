"""What a clearance call answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from engine.arrays import FloatArray
from engine.solids.base import setters_of


class Feature(NamedTuple):
    """What of a body the nearest point lies on.

    kind: vertex, edge or face; ball; plane (of a half_space). indices: of a vertex one index, of an edge two, the
    smaller first, of a face its own; none of a ball or a plane. Vertices are numbered as given (polygon: over all
    rings; aabb: bit k of a corner's number says low or high on axis k), of several at one position the first; aabb
    faces are 0..5 = xmin, xmax, ymin, ymax, zmin, zmax. What lies inside a face is on it, whatever it was cut into.
    """

    kind: Literal["vertex", "edge", "face", "ball", "plane"]
    indices: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Clearance:
    """How far apart two bodies are.

    distance: the double nearest to the exact distance; 0.0 exactly where they have a common point. points: (2, d) a
    point of each at that distance, and features what these lie on (`Feature`); None where they have a common point.
    """

    distance: float
    points: FloatArray | None = None
    features: tuple[Feature, Feature] | None = None

    def __init__(
        self, distance: float, points: FloatArray | None = None, features: tuple[Feature, Feature] | None = None
    ) -> None:
        _set_distance(self, distance)
        _set_points(self, points)
        _set_features(self, features)


_set_distance, _set_points, _set_features = setters_of(Clearance)
