"""Exact answers to questions about bodies: `import exact_geometry as eg`; the names are those of `engine`.

In an installed wheel all code lives here, as `exact_geometry.engine` and `exact_geometry.service`. In a checkout they
are the packages `engine` and `service` beside this one. Where another package has one of these names, ours is imported
by the longer name alone: its sources are read with that in place of the plain one.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from exact_geometry._names import Names, Same
from exact_geometry._renaming import renamed

if TYPE_CHECKING:
    from engine import *  # noqa: F403
    from engine import __all__, __version__  # noqa: F401

_ROOT = Path(__file__).resolve().parents[1]


def _is_ours(name: str) -> bool:
    """Return whether the first package of a name on the path is that of this checkout."""
    module = sys.modules.get(name) or find_spec(name)
    file = getattr(module, "__file__", None) or getattr(module, "origin", None)
    return file is not None and Path(file).resolve().parent == _ROOT / name


class _Loader(SourceFileLoader):
    """Reads one of our sources; its bytecode is in a file beside that of the same source as it stands."""

    def source_to_code(self, data: Any, path: Any, *, _optimize: int = -1) -> Any:  # type: ignore[override]
        text = renamed(data.decode("utf-8"))
        return compile(text, path, "exec", dont_inherit=True, optimize=_optimize)

    def get_data(self, path: str) -> bytes:
        return super().get_data(_beside(path))

    def set_data(self, path: str, data: Any, *, _mode: int = 0o666) -> None:
        super().set_data(_beside(path), data, _mode=_mode)


def _beside(path: str) -> str:
    return f"{path[:-4]}.renamed.pyc" if path.endswith(".pyc") else path


class _Finder:
    """Finds the packages of a checkout under their longer names: the same modules, where both plain names are ours."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None) -> ModuleSpec | None:
        plain = name.removeprefix(f"{__name__}.")
        top = plain.partition(".")[0]
        if plain == name or top not in ("engine", "service"):
            return None
        if _is_ours("engine") and (top == "engine" or _is_ours("service")):
            return ModuleSpec(name, Same(plain))  # type: ignore[arg-type]
        spec = PathFinder.find_spec(name, [str(_ROOT)] if plain == top else path)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec


def __getattr__(name: str) -> Any:
    if name == "service":
        return import_module(f"{__name__}.service")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


if Path(__file__).with_name("engine").is_dir():  # an installed wheel
    if "_exact_geometry_names" not in sys.modules:  # without its .pth file: `pip install --target`
        sys.meta_path.append(Names(False))
else:
    sys.meta_path.insert(0, _Finder)
_ours = import_module(f"{__name__}.engine")
globals().update({name: getattr(_ours, name) for name in (*_ours.__all__, "__all__", "__version__")})


def __dir__() -> list[str]:
    return sorted(__all__)
