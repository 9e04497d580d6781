"""The squared distance of two triangles in integers, against every choice of corners; whatever feature is suggested."""

from __future__ import annotations

import random

from engine.collision.clearance.exact import nearest_of_triangles
from engine.collision.clearance.near_triangles import FACE
from tests.reference.distance import squared_distance
from tests.reference.exact import Q, square, sub, vector


def test_is_the_least_of_all_choices_of_corners_from_any_suggestion() -> None:
    rng = random.Random(5)
    for _ in range(60):
        s, t = ([tuple(rng.randint(0, 3) for _ in range(3)) for _ in range(3)] for _ in range(2))
        t = [(x + 4, y, z) for x, y, z in t]  # apart, often parallel, often without area
        expected = squared_distance(*[tuple(dict.fromkeys(map(vector, hull))) for hull in (s, t)])
        for first, second in [(0, 0), (rng.randrange(7), rng.randrange(7)), (FACE, 1)]:
            gap = nearest_of_triangles((s[0], s[1], s[2]), (t[0], t[1], t[2]), first, second)
            assert Q(gap.top, gap.bottom) == expected, (s, t, first, second)
            p, q = ([Q(x, end.denominator) for x in end.numerators] for end in (gap.p, gap.q))
            assert square(sub(tuple(p), tuple(q))) == expected
