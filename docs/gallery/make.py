"""Make all pictures again: ``python docs/gallery/make.py`` from the root of the repository."""

import runpy
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
OTHERS = {"make", "drawing", "site"}


def make() -> list[str]:
    """Run every script of this folder, and return their names: each writes the picture of its name."""
    sys.path[:0] = [str(HERE), str(HERE.parents[1])]
    names = sorted(path.stem for path in HERE.glob("*.py") if path.stem not in OTHERS)
    for name in names:
        runpy.run_path(str(HERE / f"{name}.py"))
    return names


if __name__ == "__main__":
    print("\n".join(make()))
