"""Says which edges of a mesh are open, or used more often in one direction than in the other."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.arrays import FloatArray, IntArray
from engine.errors import InconsistentOrientationError, NotClosedError
from engine.parallel import Budget
from engine.solids.checks import digits
from engine.solids.mesh_checks import name_unbalanced

_N_NAMED: Final = 3  # edges that a message names


def unbalanced_edges(
    vertices: FloatArray, offsets: IntArray, indices: IntArray, merged: IntArray, budget: Budget
) -> NotClosedError | InconsistentOrientationError:
    """Return the error that names the first edges that are not used equally often in both directions.

    indices, merged: the corners of all faces, as given and with equal positions made one index. An edge between two
    corners at one position has no length and both directions at once: it is left out.
    """
    named = np.empty((_N_NAMED, 5), np.int64)
    n_odd, n_turned = name_unbalanced(offsets, merged, len(vertices), named, budget.flag)
    budget.check()
    kind: type[NotClosedError | InconsistentOrientationError]
    if n_odd > 0:
        kind, n, claim = NotClosedError, n_odd, "are open"
        advice = "close the mesh, or use a surface for collision only"
    else:
        kind, n, claim = InconsistentOrientationError, n_turned, "are not used equally often in both directions"
        advice = "turn the faces that run the wrong way"
    lines = [
        f"edge {indices[corner]}-{indices[following]} of face {face}, "
        f"from {digits(vertices[indices[corner]])} to {digits(vertices[indices[following]])}, "
        f"used {forth} times in this direction and {back} in the other"
        for face, corner, following, forth, back in named[named[:, 0] >= 0].tolist()
    ]
    more = "; ..." if n > len(lines) else ""
    return kind(f"{n} edges {claim}: {'; '.join(lines)}{more}; {advice}", ("faces", int(named[0, 0])))
