"""Sets that only ever grow together."""

from __future__ import annotations


class UnionFind:
    """Disjoint sets of 0 .. n - 1, with path halving; the root of a set is its smallest member."""

    __slots__ = ("parent",)

    def __init__(self, n: int) -> None:
        self.parent = list(range(n))

    def find(self, member: int) -> int:
        """Return the root of the set that holds `member`."""
        parent = self.parent
        while parent[member] != member:
            parent[member] = member = parent[parent[member]]
        return member

    def unite(self, first: int, second: int) -> None:
        """Make one set of those that hold `first` and `second`."""
        first, second = self.find(first), self.find(second)
        if first < second:
            self.parent[second] = first
        else:
            self.parent[first] = second
