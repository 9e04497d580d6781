"""All that the engine takes from numba's inside; where a name is missing, importing a part fails and says which.

`compilers` are the steps by which kernels and inner functions are compiled, `caches` keep them on disk; neither needs
the other.
"""

from __future__ import annotations

import numba


def require(names: dict[type, tuple[str, ...]]) -> None:
    """Raise ImportError unless classes of numba have these names."""
    for owner, asked in names.items():
        for name in asked:
            if not hasattr(owner, name):
                raise ImportError(f"numba {numba.__version__} has no {owner.__name__}.{name}")
