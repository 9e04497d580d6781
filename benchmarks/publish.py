"""The judged inputs of the report with their exact answers, a file a contest: for whoever judges another library.

    python -m benchmarks publish FOLDER            # writes all, and SHA256SUMS beside them
    python -m benchmarks publish FOLDER --check    # says which differ from benchmarks/inputs.sha256, where those stand

A file is JSON under gzip: `solids` by their SHA-256, then `questions`: path and body as the service takes them, a solid
named ``{"sha256": ...}``, or rows of numbers where no endpoint asks; and `exact`, the answers by rational arithmetic in
the same order. Where only what contenders differ on is settled, the first twenty stand here.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.contest import Contest, Size
from benchmarks.errors import plain
from benchmarks.fields import tasks
from benchmarks.workloads import MissingDataError

SUMS = Path(__file__).with_name("inputs.sha256")
N_SETTLED = 20


class Solids:
    """The solids of a file by their SHA-256, each hashed once."""

    def __init__(self) -> None:
        self.found: dict[str, Any] = {}
        self._digests: dict[int, str] = {}
        self._kept: list[Any] = []  # so that no other solid gets the id of one

    def named(self, value: Any) -> Any:
        """Return a request with each solid in it named by its hash."""
        if isinstance(value, list | tuple):
            return [self.named(each) for each in value] if any(isinstance(each, dict) for each in value) else value
        if not isinstance(value, dict):
            return value
        if "type" not in value:
            return {key: self.named(each) for key, each in value.items()}
        if id(value) not in self._digests:
            digest = hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
            self._digests[id(value)], self.found[digest] = digest, value
            self._kept.append(value)
        return {"sha256": self._digests[id(value)]}


def content(contest: Contest) -> bytes:
    """Return the file of a contest."""
    settled = np.arange(min(N_SETTLED, len(contest.items)))
    exact = contest.exact(settled) if callable(contest.exact) else contest.exact
    solids, ask = Solids(), contest.request or (lambda item: plain(contest.items[item]))
    questions = [solids.named(ask(item)) for item in range(len(exact))]
    found = {"operation": contest.operation, "contest": contest.name, "about": contest.about, "solids": solids.found,
             "questions": questions, "exact": [plain(each) for each in exact]}  # fmt: skip
    return gzip.compress(json.dumps(found).encode(), mtime=0)


def main(words: list[str] | None = None) -> int:
    """Write the files; 1 if one is not as stored."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--check", action="store_true", help="compare with the stored hashes")
    parser.add_argument("--only", default="", metavar="WORD", help="only contests whose name contains WORD")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(words)
    sums, some = [], [task for task in tasks(Size(given.seed), is_page=True) if given.only in task.name]
    if not some:
        parser.error(f"no contest has {given.only!r} in its name")
    try:
        given.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(str(error))
    for task in some:
        try:
            contest = task.make()
        except MissingDataError as error:
            print(f"{task.name}: skipped: {error}")
            continue
        name = f"{contest.operation} {contest.name}".replace(",", "").replace(" ", "-") + ".json.gz"
        (given.folder / name).write_bytes(found := content(contest))
        sums.append(f"{hashlib.sha256(found).hexdigest()}  {name}")
        print(sums[-1], flush=True)
    (given.folder / "SHA256SUMS").write_text("\n".join(sums) + "\n")
    other = [line for line in sums if line not in SUMS.read_text().splitlines()] if given.check else []
    print("\n".join(f"not as stored: {line.split()[1]}" for line in other), end="\n" * bool(other))
    return int(bool(other))
