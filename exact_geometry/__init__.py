"""The engine under a name that nobody else has: `import exact_geometry as eg`; the names are those of `engine`.

Where the first `engine` on the path is ours, the two are one. Where it is another's, ours is imported beside it as
`exact_geometry.engine`: its sources are read with that name in place of `engine`, and its kernels are kept apart.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

_ENGINE = Path(__file__).resolve().parents[1] / "engine"
_NAME = f"{__name__}.engine"


class _Renamed(ast.NodeTransformer):
    """Imports of `engine` that ask for the package beside this one."""

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.ImportFrom:
        node.module = _renamed(node.module or "")
        return node

    def visit_Import(self, node: ast.Import) -> ast.Import:
        for each in node.names:
            each.name = _renamed(each.name)
        return node


def _renamed(module: str) -> str:
    return f"{__name__}.{module}" if module.split(".")[0] == "engine" else module


class _Loader(SourceFileLoader):
    """Reads one of our sources; its bytecode is kept in a file beside that of the same source as it stands."""

    def source_to_code(self, data: Any, path: Any, *, _optimize: int = -1) -> Any:  # type: ignore[override]
        return compile(_Renamed().visit(ast.parse(data, path)), path, "exec", dont_inherit=True, optimize=_optimize)

    def get_data(self, path: str) -> bytes:
        return super().get_data(_beside(path))

    def set_data(self, path: str, data: Any, *, _mode: int = 0o666) -> None:
        super().set_data(_beside(path), data, _mode=_mode)


def _beside(path: str) -> str:
    return f"{path[:-4]}.renamed.pyc" if path.endswith(".pyc") else path


class _Finder:
    """Finds our sources under their other name."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None) -> ModuleSpec | None:
        if not f"{name}.".startswith(f"{_NAME}."):
            return None
        spec = PathFinder.find_spec(name, [str(_ENGINE.parent)] if name == _NAME else path)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec


_found = sys.modules.get("engine") or find_spec("engine")
_file = getattr(_found, "__file__", None) or getattr(_found, "origin", None)
if _file and Path(_file).resolve().parent == _ENGINE:
    from engine import *  # noqa: F403
    from engine import __all__, __version__  # noqa: F401
else:
    sys.meta_path.insert(0, _Finder)
    _ours = import_module(_NAME)
    globals().update({name: getattr(_ours, name) for name in (*_ours.__all__, "__all__", "__version__")})


def __dir__() -> list[str]:
    return sorted(__all__)
