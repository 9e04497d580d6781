"""Public: which of many solids hold each of many points; what a `Scene` answers about points."""

from __future__ import annotations

from typing import Any, Literal, Unpack, overload

from engine.distance.clearance import checked_distance
from engine.errors import EmptyGeometryError
from engine.running.budget import Budget, Cancel, reading
from engine.running.parallel import Options, Progress, check_options
from engine.scenes.bodies import Bodies, checked_bodies
from engine.scenes.distances import SceneDistances, measure_all
from engine.scenes.locate import SceneLocations, locate_all
from engine.scenes.placements import Placements
from engine.solids.accepted import PointsLike, PosesLike, SolidsLike
from engine.solids.base import Immutable
from engine.solids.checks import as_points
from engine.types import Accuracy, BoolArray


class PointQueries(Immutable):
    """Base of `Scene`, with its bodies in their places."""

    __slots__ = ("_placements",)

    _placements: Placements

    def __init__(self, placements: Placements) -> None:
        object.__setattr__(self, "_placements", placements)

    @property
    def _dimension(self) -> int | None:
        """The dimension of the bodies; None where there are none."""
        solids = self._placements.base.solids
        return solids[0].dimension if solids else None

    def locate(
        self,
        points: object,
        *,
        workers: int | None = None,
        deadline: float | None = None,
        cancel: Cancel | None = None,
        progress: Progress | None = None,
        report: bool = False,
    ) -> SceneLocations | tuple[SceneLocations, Accuracy]:
        """Find for each point the bodies that contain it; as `locate_scene`, with what is prepared cached.

        Parameters
        ----------
        points, workers, deadline, cancel, progress, report
            As for `locate_scene`.

        Returns
        -------
        SceneLocations
            With ``report=True`` a pair of it and an `Accuracy`.
        """
        check_options(workers, progress, report=report)
        array = as_points(points, self._dimension, must_be_finite=False)
        with Budget(deadline, cancel, workers) as budget:
            answer = locate_all(array, self._placements, budget, workers, progress)
        return answer if report else answer[0]

    def distances(
        self,
        points: object,
        *,
        within: float | None = None,
        workers: int | None = None,
        deadline: float | None = None,
        cancel: Cancel | None = None,
        progress: Progress | None = None,
        report: bool = False,
    ) -> SceneDistances | BoolArray | tuple[SceneDistances | BoolArray, Accuracy]:
        """Find for each point the nearest body, its distance, and the nearest point; as `engine.distances`.

        Parameters
        ----------
        points, workers, deadline, cancel, progress, report
            As for `locate_scene`.
        within : float, optional
            A distance; the answer is then, for each point, whether a body is within it.

        Returns
        -------
        SceneDistances
            With `within` an ndarray of bool, shape (n,); with ``report=True`` a pair of it and an `Accuracy`.

        Raises
        ------
        UnsupportedSolidError
            A body is an implicit solid or csg.
        EmptyGeometryError
            The scene has no body, or a body that counts has no point.
        EngineError
            As `engine.distances`.

        Notes
        -----
        Bodies are closed sets: a point in one is 0 away. Accuracy is that of `engine.distances`. Cost: O(log
        bodies), and `engine.distances` from those few that may be the nearest; a convex body costs 10^-4 s and more.

        Examples
        --------
        >>> from engine import Aabb, Scene, Sphere
        >>> scene = Scene([Sphere([5, 0], 1), Aabb([1, -1], [2, 1])])
        >>> near = scene.distances([[0, 0], [3.5, 0]])
        >>> near.body.tolist(), near.distance.tolist()
        ([1, 0], [1.0, 0.5])
        """
        check_options(workers, progress, report=report)
        if self._dimension is None:
            raise EmptyGeometryError("a scene without bodies has no point to be near", ("bodies",))
        limit = None if within is None else checked_distance(within, "within")
        array = as_points(points, self._dimension)
        with Budget(deadline, cancel, workers) as budget:
            answer: Any = measure_all(array, self._placements, limit, budget, workers, progress)
        return answer if report else answer[0]


@overload
def locate_scene(
    points: PointsLike,
    solids: SolidsLike,
    poses: PosesLike | None = None,
    *,
    report: Literal[False] = False,
    **options: Unpack[Options],
) -> SceneLocations: ...
@overload
def locate_scene(
    points: PointsLike,
    solids: SolidsLike,
    poses: PosesLike | None = None,
    *,
    report: Literal[True],
    **options: Unpack[Options],
) -> tuple[SceneLocations, Accuracy]: ...
def locate_scene(
    points: PointsLike,
    solids: SolidsLike,
    poses: PosesLike | None = None,
    *,
    workers: int | None = None,
    deadline: float | None = None,
    cancel: Cancel | None = None,
    progress: Progress | None = None,
    report: bool = False,
) -> SceneLocations | tuple[SceneLocations, Accuracy]:
    """Find for each point the bodies that contain it, inside or on the boundary.

    Parameters
    ----------
    points : array_like, shape (n_points, dimension)
        Borrowed, and may be empty.
    solids : sequence of Solid
        Any type but surfaces, all of the points' dimension; one object may stand for many bodies.
    poses : sequence of Pose or None, optional
        One for each solid, None for a body that stands where its solid does.
    workers, deadline, cancel, progress, report
        As for `locate`; progress counts points.

    Returns
    -------
    SceneLocations
        With ``report=True`` a pair of it and an `Accuracy`.

    Raises
    ------
    InvalidArrayError, WrongDimensionError, NotFiniteError, UnsupportedSolidError
        For arguments that break a rule; the message names the body or point.
    DeadlineExceededError, CancelledError
        The call was ended.

    Notes
    -----
    Boundary: a point on a wall that two bodies share is on both.

    Degenerate input: no points and no solids are accepted; solids as in `locate`.

    Accuracy: exact, also for posed solids: a body is the exact image R p + t under the matrix as given, not under a
    nearby rotation; a sphere keeps its radius about the exact image of its centre.

    Cost: bodies whose boxes contain the points; bodies without bounds (half_space, convex, implicit, the prism over a
    triangle of space) are tested for every point. The same as `Scene.locate` of a scene made for this call; for one
    solid use `locate`.

    References
    ----------
    Ericson, Real-Time Collision Detection, 2005, chapter 6 (trees over boxes).

    Examples
    --------
    >>> from engine import Aabb, Pose, locate_scene
    >>> box = Aabb([0, 0], [1, 1])
    >>> held = locate_scene([[0.5, 0.5], [1, 0.5], [9, 9]], [box, box], [None, Pose([[1, 0], [0, 1]], [1, 0])])
    >>> held.offsets.tolist(), held.indices.tolist(), held.on_boundary.tolist()
    ([0, 1, 3, 3], [0, 0, 1], [False, True, True])
    """
    with reading(deadline, cancel) as reader:
        scene = PointQueries(Placements(Bodies(*checked_bodies(solids, poses)), {}))
    limits: Options = {"workers": workers, "deadline": reader.left(), "cancel": cancel, "progress": progress}
    return scene.locate(points, report=report, **limits)
