"""The command line of the engine, under the other name."""

import sys
from importlib import import_module

import exact_geometry

if __name__ == "__main__":
    package = exact_geometry.locate.__module__.removesuffix(".containment.locate")
    sys.exit(import_module(f"{package}.__main__").main())
