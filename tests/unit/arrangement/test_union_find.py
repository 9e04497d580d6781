"""Sets grow together; the root is the smallest member whatever the order of uniting."""

from __future__ import annotations

from itertools import permutations

from engine.arrangement.union_find import UnionFind


def test_root_is_the_smallest_member() -> None:
    for order in permutations([(4, 2), (2, 5), (1, 5), (3, 0)]):
        sets = UnionFind(6)
        for first, second in order:
            sets.unite(first, second)
        assert [sets.find(member) for member in range(6)] == [0, 1, 1, 0, 1, 1]
