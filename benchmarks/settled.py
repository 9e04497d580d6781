"""Who is right where two contenders differ about a pose: settled by tests/reference, rationals that share nothing with
the engine. Float64 boxes, padded far beyond rounding, only throw out pairs of faces that cannot meet."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.poses import Pair
from benchmarks.workloads import Mesh

try:
    from tests.reference.contact import triangles_meet
    from tests.reference.containment import locate_by_triangles
    from tests.reference.solids import image

    REASON = ""
except ImportError as error:  # the reference needs gmpy2
    REASON = f"who is right needs {error.name}, of the extra test"

MOST = 20
"""So many poses are settled: a large mesh takes seconds."""
_PADDING = 1e-9


class _Body:
    """A mesh under a pose: float64 boxes of its faces, and their exact corners when asked for."""

    def __init__(self, mesh: Mesh, pose: dict[str, Any] | None) -> None:
        self.mesh, self.pose = mesh, pose
        placed = mesh.vertices
        if pose is not None:
            placed = placed @ np.array(pose["rotation"]).T + np.array(pose["translation"])
        corners, padding = placed[mesh.faces], _PADDING * np.abs(placed).max()
        self.placed, self.low, self.high = placed, corners.min(axis=1) - padding, corners.max(axis=1) + padding
        self._images: dict[int, Any] = {}

    def vertex(self, number: int) -> Any:
        if number not in self._images:
            self._images[number] = image(self.mesh.vertices[number].tolist(), self.pose)
        return self._images[number]

    def face(self, number: int) -> Any:
        return tuple(self.vertex(vertex) for vertex in self.mesh.faces[number].tolist())

    def one_of_each_part(self) -> list[int]:
        """Return a vertex of every connected part."""
        labels, faces = np.arange(len(self.mesh.vertices)), self.mesh.faces
        while True:  # bound: labels only fall
            least = labels.copy()
            np.minimum.at(least, faces.ravel(), np.repeat(labels[faces].min(axis=1), 3))
            if (least == labels).all():
                return np.unique(labels[faces]).tolist()
            labels = least

    def holds_part_of(self, other: _Body) -> bool:
        """Tell whether a part of another body, which meets no face of this one, lies inside."""
        low, high = self.low.min(axis=0), self.high.max(axis=0)
        near = [v for v in other.one_of_each_part() if ((low <= other.placed[v]) & (other.placed[v] <= high)).all()]
        faces = [self.face(number) for number in range(len(self.mesh.faces))] if near else []
        return any(locate_by_triangles(other.vertex(v), faces) > 0 for v in near)


def collides(pair: Pair, row: int) -> bool:
    """Return whether the two bodies, closed sets, have a common point at one pose."""
    pose = {"rotation": pair.rotations[row].tolist(), "translation": pair.translations[row].tolist()}
    a, b = _Body(pair.first, None), _Body(pair.second, pose)
    near = np.flatnonzero(((a.low <= b.high.max(axis=0)) & (a.high >= b.low.min(axis=0))).all(axis=1))
    for face in near.tolist():
        for other in np.flatnonzero(((b.low <= a.high[face]) & (b.high >= a.low[face])).all(axis=1)).tolist():
            if triangles_meet(a.face(face), b.face(other)):
                return True
    return pair.is_closed and (a.holds_part_of(b) or b.holds_part_of(a))


def judged(pair: Pair, ours: np.ndarray, theirs: np.ndarray, peer: str) -> tuple[str, dict[str, int]]:
    """Return how many of the answers (True: collides) differ and who is wrong there, in words and as numbers."""
    differing = np.flatnonzero(ours != theirs).tolist()
    text, counts = f"{len(differing)} answers differ", {"differ": len(differing)}
    if not differing:
        return text, counts
    if REASON:
        return f"{text} ({REASON})", counts
    settled = differing[:MOST]
    ours_wrong = sum(collides(pair, row) != bool(ours[row]) for row in settled)
    counts |= {"settled": len(settled), "ours_wrong": ours_wrong, "peer_wrong": len(settled) - ours_wrong}
    part = "" if len(settled) == len(differing) else f"of the first {len(settled)} "
    return f"{text}: {part}ours wrong {ours_wrong}, {peer} wrong {len(settled) - ours_wrong}", counts
