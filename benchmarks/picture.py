"""The report's picture as SVG, drawn without a background in tones that read on light and dark pages."""

from __future__ import annotations

import math
from typing import Any

from benchmarks.web_page import faults, tone

TONE = "#8a9099"
GOOD, SLOW, BAD = "#2b8a3e", "#d9730d", "#e03131"
TONES = {"faster": GOOD, "same": TONE, "slower": SLOW}
LEFT, WIDE, LINE = 170, 240, 24
"""Where the axis begins, how wide it is, how high a line."""


def text_of(queried: list[dict[str, Any]]) -> str:
    """Return all questions: a ring for easy and a disc for hard input on an axis of speed, then who is wrong."""
    axis, beside = LEFT + WIDE / 2, LEFT + WIDE + 20
    heads = ((LEFT, "100x slower", "start"), (axis, "same", "middle"), (LEFT + WIDE, "100x faster", "end"),
             (beside, "wrong on hard input, the fastest first", "start"))  # fmt: skip
    parts = [_text(x, 14, words, anchor) for x, words, anchor in heads]
    for number, each in enumerate(sorted(queried, key=lambda each: each["is_alone"])):
        y, words = 36 + LINE * number, []
        parts.append(_text(0, y + 4, each["title"]))
        parts.append(f'<path d="M{LEFT} {y}h{WIDE}M{axis} {y - 8}v16" stroke="{TONE}" stroke-opacity=".6"/>')
        for side, one in each["sides"].items():
            if one["ratio"] is not None:
                x = axis + WIDE / 2 * max(-1.0, min(1.0, math.log10(one["ratio"]) / 2))
                color = TONES[tone(one["ratio"])]
                fill = f'fill="{color}"' if side == "hard" else 'fill="none"'
                parts.append(f'<circle cx="{x:.1f}" cy="{y}" r="5" stroke="{color}" stroke-width="2" {fill}/>')
        for one in each["seen"]:
            color = BAD if one["wrong"] else SLOW if one["refused"] + one["outside"] else GOOD
            words.append(f'<tspan fill="{color}">{faults(one)}</tspan>')
        parts.append(_text(beside, y + 4, "&#160; ".join(words)))
    size = f'viewBox="0 0 1000 {40 + LINE * len(queried)}" font-family="sans-serif" font-size="13"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>\n' + "\n".join(parts) + "\n</svg>\n"


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x:g}" y="{y}" fill="{TONE}" text-anchor="{anchor}">{text}</text>'
