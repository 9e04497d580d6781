"""Imports of `engine`, `service` and `benchmarks`, rewritten to ask for `exact_geometry.engine` and so on."""

from __future__ import annotations

import re

_IMPORT = re.compile(
    r"^([ \t]*(?:from|import)[ \t]+)((engine|service|benchmarks)\b[.\w]*)([ \t]+import\b|[ \t]+as\b|[ \t]*(?=#|$))",
    re.M,
)


def renamed(source: str) -> str:
    """Return the source of a module with its imports rewritten; no line moves."""
    return _IMPORT.sub(lambda at: f"{at[1]}exact_geometry.{at[2]}{at[4] if at[4].strip() else f' as {at[3]}'}", source)
