"""Features one after another against a layer that stays: in memory are the layer and some features at a time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from engine.errors import InvalidInputError, InvalidOperationError
from engine.layers.feature_joins import join_features, locate_features, nearest_features
from engine.layers.feature_rows import FeatureRows
from engine.layers.features import clip_features
from engine.layers.geojson import AREAS, EVERY, collection_of
from engine.layers.limits import Limits
from engine.running.budget import Cancel
from engine.solids.checks import shown

_Entry = tuple[Callable[..., Any], tuple[str, ...], tuple[str, ...], tuple[str, ...]]
OPERATIONS: Final[dict[str, _Entry]] = {
    "clip": (clip_features, EVERY, AREAS, ("keep", "grid", "wrap")),
    "join": (join_features, EVERY, EVERY, ("predicate", "distance", "outside")),
    "nearest": (nearest_features, EVERY, EVERY, ("max_distance", "exclusive", "outside")),
    "contains": (locate_features, ("Point",), AREAS, ("outside",)),
}
"""By name: function, kinds of geometries of the features and of the layer, options."""


class FeatureStream:
    """One operation on many features against one layer; answers of parts are those of all features at once.

    Parameters
    ----------
    operation : {"clip", "join", "nearest", "contains"}
        As `clip_features`, `join_features`, `nearest_features` and `locate_features`.
    layer : dict
        A FeatureCollection: the mask, the right layer, the polygons.
    deadline, cancel
        As for `engine.locate`: for reading the layer.
    **options
        Of the function.

    Raises
    ------
    EngineError
        As the function.

    Notes
    -----
    Properties of the layer get the suffix _2, and those of features that have one of these names _1: what later
    features have is not known. Cost: the layer is read and prepared once.

    References
    ----------
    RFC 8142 (GeoJSON text sequences).

    Examples
    --------
    >>> from engine import layers, read_layer
    >>> triangle = read_layer(b'{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [0, 2], [0, 0]]]}')
    >>> stream = layers.FeatureStream("contains", triangle)
    >>> point = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [1, 1]}}
    >>> [len(stream.rows([point])) for _ in range(2)]
    [1, 1]
    """

    def __init__(
        self, /, operation: str, layer: Any, *, deadline: float | None = None, cancel: Cancel | None = None,
        **options: Any,
    ) -> None:  # fmt: skip
        if not isinstance(operation, str) or operation not in OPERATIONS:
            what = f"operation must be one of {', '.join(OPERATIONS)}; got {shown(operation)}"
            raise InvalidOperationError(what, ("operation",))
        self._function, self._kinds, kinds, names = OPERATIONS[operation]
        if wrong := sorted(options.keys() - set(names)):
            what = f"{operation} takes no option {wrong[0]!r:.100}; it takes {', '.join(names)}"
            raise InvalidInputError(what, (wrong[0],))
        limits = Limits(deadline, cancel)
        self._layer, self._options = collection_of(layer, ("layer",), limits, kinds), options
        self.n_features = 0
        """Features so far."""
        self.rows([], deadline, cancel)  # checks the options

    def rows(self, features: list[Any], deadline: float | None = None, cancel: Cancel | None = None) -> FeatureRows:
        """Return the rows of the next features.

        Parameters
        ----------
        features : list of dict
            GeoJSON features.
        deadline, cancel
            As for `engine.locate`.

        Returns
        -------
        FeatureRows
            Numbers of features count from the first of the stream.

        Raises
        ------
        EngineError
            As the function.
        """
        collection = {"type": "FeatureCollection", "features": features}
        limits = Limits(deadline, cancel)
        some = collection_of(collection, ("stream",), limits, self._kinds, self.n_features)
        made: FeatureRows = self._function(some, self._layer, **self._options, **limits.time())
        self.n_features += len(features)
        return made
