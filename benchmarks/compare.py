"""Compare two stored reports: ``python -m benchmarks compare old.json new.json``, of two machines or two commits.

Prints, for each row of both, how many times faster the second is, and every change in wrong answers. Exit code 1 if the
second has more wrong answers of ours.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

from benchmarks.table import named


def main(words: list[str] | None = None) -> int:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    given = parser.parse_args(words)
    try:
        old, new = (json.loads(path.read_text()) for path in (given.old, given.new))
        before, after = _by_key(old), _by_key(new)
        for name, found in (("old", old), ("new", new)):
            facts = f"{found['processor']}, {found['cores']} cores, seed {found['seed']}"
            print(f"{name}: commit {found['commit']}, {facts}")
    except (OSError, ValueError) as error:
        parser.error(str(error))
    except (KeyError, TypeError) as error:
        parser.error(f"no results of a report: {error!r}")
    if not set(before) & set(after):
        parser.error("the two have no row in common")
    print(f"{'contest':<46} {'contender':<34} {'speed':>8}  {'to ours':>8}  wrong")
    worse = 0
    for key, row in after.items():
        was = before.get(key)
        if was is None or not (row["rate"] and was["rate"]):
            continue
        base, ratio = (*key[:2], "ours"), row["rate"] / was["rate"]
        relative = ratio * before[base]["rate"] / after[base]["rate"] if base in before and base in after else math.nan
        wrong = [each["errors"].get("wrong", 0) for each in (was, row)]
        changed = f"{wrong[0]} -> {wrong[1]}" if wrong[0] != wrong[1] else str(wrong[1])
        print(f"{', '.join(key[:2]):<46} {key[2]:<34} {ratio:>7.2f}x  {relative:>7.2f}x  {changed}")
        worse += key[2] == "ours" and wrong[1] > wrong[0]
    return 1 if worse else 0


def _by_key(found: dict[str, Any]) -> dict[tuple[str, str, str], dict[str, Any]]:
    return {
        (row["operation"], row["contest"], named(row["contender"], row.get("setting"))): row for row in found["rows"]
    }
