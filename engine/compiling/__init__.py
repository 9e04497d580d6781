"""Everything that the engine uses of numba's internals; if a name is missing, the import fails and names it.

`compilers` compiles kernels and inner functions, `caches` stores them on disk; neither needs the other.
"""

from __future__ import annotations

import numba


def require(names: dict[type, tuple[str, ...]]) -> None:
    """Raise ImportError unless the classes of numba have these attributes."""
    for owner, needed in names.items():
        for name in needed:
            if not hasattr(owner, name):
                raise ImportError(f"numba {numba.__version__} has no {owner.__name__}.{name}")
