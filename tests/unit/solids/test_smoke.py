"""Every solid can be made, is immutable, pickles and prints."""

from __future__ import annotations

import copy
import pickle

import pytest

import engine

TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
SOLIDS: list[engine.Solid] = [
    engine.HalfSpace([0, 0, 1], -2),
    engine.Sphere([0, 0, 0], 1),
    engine.Aabb([0, 0, 0], [1, 2, 3]),
    engine.Convex([[1, 0, 0], [0, 1, 0], [-1, -1, 1]]),
    engine.Polyhedron(*TETRAHEDRON),
    engine.Surface(*TETRAHEDRON),
    engine.Triangle([[0, 0], [1, 0], [0, 1]]),
    engine.Polygon([[[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [2, 1], [1, 2]]]),
    engine.Implicit([{"powers": [2, 0], "coefficient": -1}, {"powers": [0, 0], "coefficient": 4}]),
    engine.Csg("union", [engine.Sphere([0, 0], 1), engine.Sphere([1, 0], 1)]),
]


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: solid.type)
def test_is_immutable_and_pickles(solid: engine.Solid) -> None:
    for name in [*solid._fields(), "anything"]:
        with pytest.raises(AttributeError, match="immutable"):
            setattr(solid, name, None)
    with pytest.raises(AttributeError, match="immutable"):
        del solid.dimension
    assert copy.copy(solid) is solid
    assert copy.deepcopy(solid) is solid
    solid.prepared("something", lambda: 1)
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(solid, protocol))
        assert type(again) is type(solid)
        assert repr(again) == repr(solid)
        assert again._prepared == {}
    assert solid.memory > 0
    assert len(repr(solid)) < 200
