"""Union-find: disjoint sets as forests, in Python and compiled."""

from __future__ import annotations

from typing import Any

from engine.compiling.jit import merged


class UnionFind:
    """Disjoint sets of the numbers 0 .. n - 1, by path halving; the root of a set is its smallest member."""

    __slots__ = ("parent",)

    def __init__(self, n: int) -> None:
        self.parent = list(range(n))

    def find(self, member: int) -> int:
        """Return the root of the set of `member`."""
        parent = self.parent
        while parent[member] != member:
            parent[member] = member = parent[parent[member]]
        return member

    def unite(self, first: int, second: int) -> None:
        """Unite the sets of `first` and `second`."""
        first, second = self.find(first), self.find(second)
        if first < second:
            self.parent[second] = first
        else:
            self.parent[first] = second


@merged
def root_of(parent: Any, i: int) -> int:
    """Return the root of the tree that contains i in a forest of parents, halving the path."""
    while parent[i] != i:  # bound: the path, which only gets shorter
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@merged
def unite(parent: Any, i: int, j: int) -> None:
    """Unite the sets of i and j in a forest of parents; the smallest member becomes the root."""
    i, j = root_of(parent, i), root_of(parent, j)
    if i < j:
        parent[j] = i
    elif j < i:
        parent[i] = j
