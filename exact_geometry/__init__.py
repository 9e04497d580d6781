"""The engine under a name that nobody else has: `import exact_geometry as eg`; the names are those of `engine`."""

from importlib.util import find_spec
from pathlib import Path

_found = find_spec("engine")
if _found is None or not _found.origin or Path(_found.origin).parents[1] != Path(__file__).parents[1]:
    raise ImportError(
        f"exact_geometry is made of a package `engine`, and another one comes first: {_found and _found.origin}; "
        "put it after the installed packages, or under another name"
    )

from engine import *  # noqa: E402, F403
from engine import __all__, __version__  # noqa: E402, F401
