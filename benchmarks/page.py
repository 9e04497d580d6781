"""Writes docs/speed_and_error.md from stored results; its fixed text is in page.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks import filed
from benchmarks.measure import interval, spread
from benchmarks.table import named
from benchmarks.web_page import (
    OURS,
    costs,
    error_share,
    failing,
    faults,
    key_of,
    percent,
    questions,
    shown,
    times,
    tone,
)

TEMPLATE = Path(__file__).with_suffix(".md")
LISTED = 8
"""Contests won by another that the head of the page names; the tables have all."""
UNLISTED = ("orientation", "containment, ", "containment 2D", "clipping polygons", "layers")
"""Operations that the README leaves to the page."""
HEAD = ("contender", "items/s", "quartiles", "ours is faster by", "net of calls", "one item: median, p99, longest",
        "first", "build", "wrong", "95%", "raised an error", "unsupported input", "coordinates off",
        "ulps, largest (median)", "beyond filter")  # fmt: skip
Row = dict[str, Any]


def text_of(result: dict[str, Any]) -> str:
    """Return the page."""
    contests = by_contest(result["rows"])
    versions = ", ".join(f"{name} {version}" for name, version in result["versions"].items())
    facts = (
        f"Commit {result['commit']}, seed {result['seed']}, {result['processor']}, {result['cores']} cores, "
        f"load {result['load_before']} before and {result['load_after']} after, {result['seconds']:.0f} s. {versions}."
    )
    tables = _tables(contests) + ("\n" + filed.section(result["filed"]) if "filed" in result else "")
    tables += _costs(result)
    parts = {"weaknesses": _weaknesses(contests), "facts": facts, "summary": _summary(result["rows"]), "tables": tables}
    text = TEMPLATE.read_text("utf-8")
    for name, part in parts.items():
        text = text.replace(f"<<{name}>>", part)
    return text


def by_contest(rows: list[Row]) -> dict[str, list[Row]]:
    """Return the rows of each contest, ours first."""
    result: dict[str, list[Row]] = {}
    for row in rows:
        result.setdefault(key_of(row), []).append(row)
    return {key: sorted(mine, key=lambda row: row["contender"] != "ours") for key, mine in result.items()}


def table(head: tuple[str, ...], rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [f"| {' | '.join(cells)} |" for cells in (head, *rows)]
    return "\n".join([lines[0], "|---" * len(head) + "|", *lines[1:]]) + "\n"


def _weaknesses(contests: dict[str, list[Row]]) -> str:
    """Return our own wrong answers, then the contests in which a contender was faster."""
    ours = [rows[0] for rows in contests.values()]
    wrong = [row for row in ours if row["errors"]["wrong"] + row["errors"]["refused"] + row["errors"].get("off", 0)]
    judged = sum(row["errors"]["judged"] for row in ours)
    lines = [
        f"**Wrong answers of {OURS}: {len(wrong)} contests**"
        if wrong
        else f"**Wrong answers of {OURS}: 0 of {judged:,}.**"
    ]
    lines += [f"- {key_of(row)}: {row['errors']}" for row in wrong]
    fastest = [(key, rows[0], max((row for row in rows if row is rows[0] or not row["contender"].startswith("ours")),
                                    key=lambda row: row["rate"])) for key, rows in contests.items()]  # fmt: skip
    slower = sorted(((best["rate"] / max(own["rate"], 1e-9), key, best) for key, own, best in fastest
                     if tone(own["rate"] / best["rate"]) == "slower"), key=lambda each: -each[0])  # fmt: skip
    right = [each for each in slower if not failing(each[2])]
    for title, listed in (("faster and never wrong here", right), ("faster", [e for e in slower if failing(e[2])])):
        lines.append(f"\n**Where another is {title}** (gross; the fastest of each contest, with its errors):\n")
        for ratio, key, best in listed[:LISTED]:
            lines.append(
                f"- {key}: {best['contender']} by {ratio:.2g} times, wrong or refused {percent(error_share(best))}"
            )
        if len(listed) > LISTED:
            lines.append(f"- and {len(listed) - LISTED} more, by at most {listed[LISTED][0]:.2g} times: see the tables")
    return "\n".join(lines)


def _summary(rows: list[Row]) -> str:
    """Return one line a question: how much faster ours is than the fastest peer, and who is wrong."""
    parts = []
    for is_alone, beside in ((False, "fastest peer"), (True, "textbook's fastest formula")):
        lines = [
            [each["title"], *(_ratio(each["sides"][side]) for side in ("easy", "hard")), _near(each["near"]),
             "; ".join(faults(one) + _climb(one["ladder"]) for one in each["seen"])]
            for each in questions(rows) if each["is_alone"] == is_alone
        ]  # fmt: skip
        head = (f"{OURS} beside the {beside}", "easy input", "hard input", "hard inputs are from the boundary",
                "wrong on hard input (moved by 1e-12, 1e-9, 1e-6), the fastest first")  # fmt: skip
        parts += [table(head, lines)] if lines else []
    return "\n".join(parts).rstrip()


def _costs(result: dict[str, Any]) -> str:
    lines = [[name, found, note] for name, found, note in costs(result)]
    return "\n## Beside speed\n\n" + table(("what", "figures, the best first", "how"), lines) if lines else ""


def _ratio(side: dict[str, Any]) -> str:
    """Return how many times faster or slower ours is, and than which contender."""
    if side["ratio"] is None:
        return "not asked"
    return f"{times(side['ratio'])} {side['name']}; {seconds(side['seconds'][0])} an item"


def _near(distance: float | None) -> str:
    """Return how far hard inputs are from the boundary, of the model's size."""
    return "as near as doubles come" if distance is None else f"{distance:.1g} of the model" if distance else "on it"


def _climb(ladder: list[float]) -> str:
    return f" ({', '.join(map(percent, ladder))})" if any(ladder) else " (0 from 1e-12 on)" if ladder else ""


def smallest(result: dict[str, Any]) -> str:
    """Return the README's table: of each operation its first hard contest, with the fastest peer (not the textbook)."""
    lines: dict[str, list[str]] = {}
    for key, (ours, *others) in by_contest(result["rows"]).items():
        peers = [row for row in others if row["package"] and row["seconds"] and row.get("setting") is None]
        if not (ours["is_hard"] and peers) or ours["operation"].startswith(UNLISTED):
            continue
        peer = max(peers, key=lambda row: row["rate"])
        wrong = f"{ours['errors']['wrong']} of {ours['errors']['judged']:,}"
        cells = [key, f"{ours['rate']:,.0f}", wrong, peer["contender"], f"{peer['rate']:,.0f}"]
        lines.setdefault(ours["operation"], [*cells, percent(error_share(peer))])
    head = ("hard inputs", f"{OURS}, a second", "wrong", "fastest peer", "a second", "wrong or refused")
    return table(head, list(lines.values()))


def _tables(contests: dict[str, list[Row]]) -> str:
    """Return a table a contest, under the names of the operations."""
    parts: dict[str, list[str]] = {}
    for rows in contests.values():
        name, about = rows[0]["operation"], rows[0].get("about", "")
        head = f"\n### {rows[0]['contest']} ({'hard' if rows[0]['is_hard'] else 'easy'})\n\n"
        head += f"{about[0].upper()}{about[1:]}.\n\n" if about else ""
        part = parts.setdefault(name, [f"\n## {name[0].upper()}{name[1:]}\n"])
        part.append(head + table(HEAD, [_cells(row, rows[0]) for row in rows]))
    return "".join(part for each in parts.values() for part in each)


def _cells(row: Row, base: Row) -> list[str]:
    name, errors = named(shown(row["contender"]), row.get("setting")), row["errors"]
    if row["absent"]:
        return [name, f"absent: {row['absent']}"] + [""] * (len(HEAD) - 2)
    result = spread(row["seconds"])
    low, high = row["n_items"] / result.high, row["n_items"] / result.low
    return [
        name, f"{row['rate']:,.0f}", f"{low:,.0f} - {high:,.0f}",
        "" if row is base else f"{base['rate'] / row['rate']:.3g}x",
        f"{base['net_rate'] / row['net_rate']:.3g}x" if row["call_overhead"] else "",
        ", ".join(seconds(each) for each in row.get("latency", {}).get("1", [])[:3]), seconds(row.get("first")),
        seconds(row["build"]), f"{errors['wrong']:,} of {errors['judged']:,}",
        " - ".join(percent(end) for end in interval(errors["wrong"], errors["judged"])), f"{errors['refused']:,}",
        f"{errors.get('outside', 0):,}", f"{errors['off']:,} of {errors['coordinates']:,}" if "off" in errors else "",
        f"{errors['ulp_largest']:.3g} ({errors['ulp_median']:.2g})" if "ulp_largest" in errors else "",
        "" if row["exact_share"] is None else percent(row["exact_share"]),
    ]  # fmt: skip


def seconds(taken: float | None) -> str:
    """Return a time in its unit."""
    if taken is None:
        return ""
    size, unit = next((each for each in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")) if taken >= each[0]), (1e-9, "ns"))
    return f"{taken / size:.3g} {unit}"
