"""The command `exact-geometry`: that of the engine, and `serve`, which is `python -m service`."""

from __future__ import annotations

import sys
from importlib import import_module

import exact_geometry


def main() -> int | None:
    """Run one command and return its exit code."""
    if sys.argv[1:2] == ["serve"]:
        serve = import_module("service.__main__").main
        serve(sys.argv[2:])
        return 0
    package = exact_geometry.locate.__module__.removesuffix(".containment.locate")
    run = import_module(f"{package}.__main__").main
    code: int = run()
    return code


if __name__ == "__main__":
    sys.exit(main())
