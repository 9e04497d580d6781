"""matplotlib: points in a compound path."""

from __future__ import annotations

import numpy as np
from matplotlib.path import Path

from benchmarks.contenders import Prepared
from benchmarks.workloads import Rings

PACKAGE = "matplotlib"
NAMES = {"": "matplotlib Path"}


def _points(subject: Rings, threads: int) -> Prepared:
    paths = [Path(np.concatenate([ring, ring[:1]]), closed=True) for ring in subject.rings]
    path = paths[0] if len(paths) == 1 else Path.make_compound_path(*paths)
    return Prepared(path.contains_points)


MAKERS = {"points": _points}
