"""What a `Scene` answers about points: which bodies contain them, how far the nearest body is."""

from __future__ import annotations

from engine.errors import EmptyGeometryError
from engine.running.budget import Budget, Cancel
from engine.running.parallel import Progress, check_options
from engine.scenes.distances import SceneDistances, measure_all
from engine.scenes.locate import SceneLocations, locate_all
from engine.scenes.placements import Placements
from engine.solids.base import Immutable
from engine.solids.checks import as_points
from engine.types import Accuracy


class PointQueries(Immutable):
    """Base of `Scene`, with its bodies in their places."""

    __slots__ = ("_placements",)

    _placements: Placements

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
        array = as_points(points, self._dimension)
        with Budget(deadline, cancel) as budget:
            answer = locate_all(array, self._placements, budget, workers, progress)
        return answer if report else answer[0]

    def distances(
        self,
        points: object,
        *,
        workers: int | None = None,
        deadline: float | None = None,
        cancel: Cancel | None = None,
        progress: Progress | None = None,
        report: bool = False,
    ) -> SceneDistances | tuple[SceneDistances, Accuracy]:
        """Find for each point the nearest body, its distance, and the nearest point; as `engine.distances`.

        Parameters
        ----------
        points, workers, deadline, cancel, progress, report
            As for `locate_scene`.

        Returns
        -------
        SceneDistances
            With ``report=True`` a pair of it and an `Accuracy`.

        Raises
        ------
        EmptyGeometryError
            The scene has no body, or a body that counts has no point.
        EngineError
            As `engine.distances`.

        Notes
        -----
        Bodies are closed sets: a point in one is 0 away. Accuracy is that of `engine.distances`. Cost: a distance from
        the box of every body for each point, then `engine.distances` from those that may be the nearest.

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
        array = as_points(points, self._dimension)
        with Budget(deadline, cancel) as budget:
            answer = measure_all(array, self._placements, budget, workers, progress)
        return answer if report else answer[0]
