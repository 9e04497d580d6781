"""The command `exact-geometry`: `serve` starts the service, all else is that of the engine."""

from __future__ import annotations

import sys
from importlib import import_module


def main() -> int:
    """Run the command that the arguments of the process name."""
    if sys.argv[1:2] == ["serve"]:
        import_module("exact_geometry.service.__main__").main(sys.argv[2:])
        return 0
    code: int = import_module("exact_geometry.engine.__main__").main()
    return code


if __name__ == "__main__":
    sys.exit(main())
