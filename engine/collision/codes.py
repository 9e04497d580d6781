"""Relations as kernels write them: the values of `engine.types.Relation`, and what is left to be settled elsewhere."""

from __future__ import annotations

UNSETTLED = -1
"""In place of a relation: weak contacts, undecided signs, or components of which only some lie inside."""

DISJOINT, FIRST_INSIDE_SECOND, SECOND_INSIDE_FIRST, OVERLAPPING, TOUCHING = range(5)  # as in engine.types.Relation
