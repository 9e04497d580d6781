"""Integer codes that the kernels of collision write: relations here, others in the modules of the table.

| code | values | module |
|---|---|---|
| relation of two bodies | as `engine.types.Relation`, or UNSETTLED | here |
| class of two faces | APART, CROSSING, ..., COMMON_AREA; CORNER + 3 k + m | triangle_triangle |
| decided class | DECIDED + 3 bits of corners a face; NO_SHARED_AREA + bits, ... | touching, pose_batch |
| kind of a contact | FACE_FACE ... CONTAINED, the places of names in STRENGTH, the strongest first | contact_kinds |
| state of a face | STATE_UNKNOWN, STATE_CLEAN, STATE_CROSSED, STATE_STACKED, the worst last | mesh_arrays |
| location of a point | OUTSIDE, 0 on a face, INSIDE, or UNDECIDED | parity |
| goal and outcome of a search | SEEK_...; DONE, SETTLED, FULL, INTERRUPTED | dual_traversal |
| two edges of the plane | APART, CROSSING, UNSURE, contacts; IN_BOTH, OUT_OF_SECOND, OUT_OF_FIRST | outline_batch |
| two forms | relation + kind << KIND_AT + face << FACE_AT + face << THEIR_FACE_AT | form_relations |
"""

from __future__ import annotations

UNSETTLED = -1
"""Code in place of a relation that is undecided: weak contacts, undecided signs, or only some components inside."""

DISJOINT, FIRST_INSIDE_SECOND, SECOND_INSIDE_FIRST, OVERLAPPING, TOUCHING = range(5)  # as in engine.types.Relation

RELATION, KIND, FIRST_FACE, SECOND_FACE, N_CONTACTS = range(5)
N_COLUMNS = 5
"""Columns of the rows that `pose_batch.relate_poses` fills.

| column | meaning |
|---|---|
| RELATION | the relation, or UNSETTLED |
| KIND, FIRST_FACE, SECOND_FACE | the witness, if requested and decided; the least face of a body that is inside |
| N_CONTACTS | number of contacts listed, ONE_SETTLES if it is one crossing that decides |
"""
