"""The report's pictures as SVG, drawn without a background in tones that read on light and dark pages."""

from __future__ import annotations

import io
import math
from typing import Any

from benchmarks.web_page import SAME, faults, questions

TONE = "#8a9099"
OURS = "#d9480f"
PEERS = {
    "shapely": "#1c7ed6", "matplotlib": "#9c36b5", "Open3D": "#2f9e44", "trimesh": "#e8a200", "libigl": "#0c8599",
    "VTK": "#c2255c", "CGAL": "#7048e8", "coal": "#5c940d", "fcl": "#ae3ec9", "manifold3d": "#1098ad",
    "pyclipper": "#e64980", "Clipper2": "#1098ad", "numba_celltree": "#94d82d", "numpy": "#4263eb",
    "fractions": "#a0522d", "ours, plain": "#ffa94d",
}  # fmt: skip
"""One colour a package in every picture; the textbook's methods are grey."""
GOOD, SLOW, BAD = "#2b8a3e", "#d9730d", "#e03131"
ZERO_LANE = 1e-6
"""Where an error rate of 0 stands on the logarithmic axis."""
SHARES: dict[str, Any] = {"ylim": (ZERO_LANE / 2, 1.5), "yticks": [ZERO_LANE, 1e-4, 1e-2, 1],
                          "yticklabels": ["0", "0.01%", "1%", "100%"]}  # fmt: skip
LEFT, WIDE, LINE = 170, 240, 24
"""Of the first picture: where its axis begins, how wide it is, how high a line."""


def draw(found: dict[str, Any]) -> dict[str, str]:
    """Return file names and their SVG text."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams |= {
        "svg.fonttype": "none", "svg.hashsalt": "report", "text.color": TONE, "axes.labelcolor": TONE,
        "axes.edgecolor": TONE, "xtick.color": TONE, "ytick.color": TONE, "font.size": 10, "axes.grid": True,
        "grid.color": TONE, "grid.alpha": 0.25, "font.family": "sans-serif",
    }  # fmt: skip
    return {
        "speed_against_error.svg": _glance(questions(found["rows"])),
        "error_by_distance.svg": _distance(found["curves"]["distance"]),
        "speed_by_size.svg": _size(found["curves"]["size"]),
    }


def _svg(figure: Any) -> str:
    import matplotlib.pyplot as plt

    text = io.StringIO()
    figure.tight_layout()
    figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    plt.close(figure)
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def _glance(asked: list[dict[str, Any]]) -> str:
    """All questions: a ring for easy and a disc for hard input on an axis of speed, then who is wrong."""
    axis, beside = LEFT + WIDE / 2, LEFT + WIDE + 20
    heads = ((LEFT, "100x slower", "start"), (axis, "same", "middle"), (LEFT + WIDE, "100x faster", "end"),
             (beside, "wrong on hard input, the fastest first", "start"))  # fmt: skip
    parts = [_text(x, 14, words, anchor) for x, words, anchor in heads]
    for number, each in enumerate(sorted(asked, key=lambda each: each["is_alone"])):
        y, words = 36 + LINE * number, []
        parts.append(_text(0, y + 4, each["title"]))
        parts.append(f'<path d="M{LEFT} {y}h{WIDE}M{axis} {y - 8}v16" stroke="{TONE}" stroke-opacity=".6"/>')
        for side, one in each["sides"].items():
            if one["ratio"] is not None:
                x = axis + WIDE / 2 * max(-1.0, min(1.0, math.log10(one["ratio"]) / 2))
                tone = GOOD if one["ratio"] >= SAME else SLOW
                fill = f'fill="{tone}"' if side == "hard" else 'fill="none"'
                parts.append(f'<circle cx="{x:.1f}" cy="{y}" r="5" stroke="{tone}" stroke-width="2" {fill}/>')
        for one in each["seen"]:
            tone = BAD if one["wrong"] else SLOW if one["refused"] + one["outside"] else GOOD
            words.append(f'<tspan fill="{tone}">{faults(one)}</tspan>')
        parts.append(_text(beside, y + 4, "&#160; ".join(words)))
    size = f'viewBox="0 0 1000 {40 + LINE * len(asked)}" font-family="sans-serif" font-size="13"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>\n' + "\n".join(parts) + "\n</svg>\n"


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x:g}" y="{y}" fill="{TONE}" text-anchor="{anchor}">{text}</text>'


def _curves(axis: Any, curves: dict[str, tuple[Any, Any]]) -> None:
    """Draw the places of each contender, both ways logarithmic, each name beside the end of its curve."""
    from matplotlib.ticker import NullFormatter

    axis.set(xscale="log", yscale="log")
    for name, (x, y) in curves.items():
        axis.plot(x, y, "o-", ms=4, lw=2.5 if name == "ours" else 1.2, color=_color(name))
    for each in (axis.xaxis, axis.yaxis):
        each.set_minor_formatter(NullFormatter())


def _name(axis: Any, curves: dict[str, tuple[Any, Any]]) -> None:
    """Put each name beside the end of its curve, moved up until it covers no other."""
    axis.get_xlim(), axis.get_ylim()  # which settles them
    to_axes = axis.transData + axis.transAxes.inverted()
    ends = sorted((to_axes.transform((x[-1], y[-1]))[1], name) for name, (x, y) in curves.items())
    free = -1.0
    for height, name in ends:
        free = max(height, free + 0.062)
        axis.text(1.01, free, name, transform=axis.transAxes, va="center", fontsize=8, color=_color(name))


def _color(name: str) -> str:
    return OURS if name == "ours" else next((tone for word, tone in PEERS.items() if name.startswith(word)), TONE)


def _distance(found: dict[str, Any]) -> str:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(12, 3.6))
    places = [max(ulps, 0.5) for ulps in found["ulps"]]
    for axis, operation in zip(axes, ("containment 2D", "containment 3D")):
        drawn = {name: (places, [share or ZERO_LANE for share in shares]) for name, shares in found[operation].items()}
        _curves(axis, drawn)
        axis.set(title=operation, xlabel="ulps of a coordinate off (leftmost: rounded onto it)", **SHARES)
        _name(axis, {name: ((x[0],), (y[0],)) for name, (x, y) in drawn.items()})
    axes[0].set_ylabel("wrong answers; names: from the left end")
    return _svg(figure)


def _size(found: dict[str, Any]) -> str:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(12, 3.6))
    for axis, (kind, label) in zip(axes, (("faces", "faces of the mesh"), ("batch", "points in one call"))):
        drawn = {name: tuple(zip(*places)) for name, places in found[kind].items()}
        _curves(axis, drawn)
        _name(axis, drawn)
        axis.set_xlabel(label)
    axes[0].set_ylabel("points a second, containment 3D")
    return _svg(figure)
