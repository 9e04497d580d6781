"""The report's pictures as SVG, drawn without a background in tones that read on light and dark pages."""

from __future__ import annotations

import io
from typing import Any

from benchmarks.web_page import error_share

TONE = "#8a9099"
OURS = "#d9480f"
PEERS = {
    "shapely": "#1c7ed6", "matplotlib": "#9c36b5", "Open3D": "#2f9e44", "trimesh": "#e8a200", "libigl": "#0c8599",
    "VTK": "#c2255c", "CGAL": "#7048e8", "coal": "#5c940d", "fcl": "#ae3ec9", "manifold3d": "#1098ad",
    "pyclipper": "#e64980", "Clipper2": "#1098ad", "numba_celltree": "#94d82d", "numpy": "#4263eb",
    "fractions": "#a0522d", "ours, plain": "#ffa94d",
}  # fmt: skip
"""One colour a package in every picture; the textbook's methods are grey, told apart by their markers."""
MARKERS = ("s", "D", "^", "v", "P")
ZERO_LANE = 1e-6
"""Where an error rate of 0 stands on the logarithmic axis."""
SHARES: dict[str, Any] = {"ylim": (ZERO_LANE / 2, 1.5), "yticks": [ZERO_LANE, 1e-4, 1e-2, 1],
                          "yticklabels": ["0", "0.01%", "1%", "100%"]}  # fmt: skip


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
        "speed_against_error.svg": _scatter(found["rows"]),
        "error_by_distance.svg": _distance(found["curves"]["distance"]),
        "speed_by_size.svg": _size(found["curves"]["size"]),
        "coordinate_errors.svg": _histograms(found["rows"]),
    }


def _svg(figure: Any) -> str:
    import matplotlib.pyplot as plt

    text = io.StringIO()
    figure.tight_layout()
    figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    plt.close(figure)
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def _looks(names: list[str]) -> dict[str, dict[str, Any]]:
    """Return colour and marker of each contender."""
    looks: dict[str, dict[str, Any]] = {}
    grey = iter(MARKERS * 9)
    for name in names:
        color = next((tone for word, tone in PEERS.items() if name.startswith(word)), None)
        looks[name] = {"color": color, "marker": "o"} if color else {"color": TONE, "marker": next(grey)}
    return looks | {"ours": {"color": OURS, "marker": "*"}}


def _log_axes(axis: Any) -> None:
    from matplotlib.ticker import NullFormatter

    axis.set(xscale="log", yscale="log")
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.yaxis.set_minor_formatter(NullFormatter())


def _scatter(rows: list[dict[str, Any]]) -> str:
    """Speed against the share of wrong or refused answers, one panel an operation, its hard contests."""
    import matplotlib.pyplot as plt

    operations = list(dict.fromkeys(row["operation"] for row in rows if row["is_hard"]))
    n_lines = -(-len(operations) // 3)
    figure, axes = plt.subplots(n_lines, 3, figsize=(11, 3.1 * n_lines), squeeze=False)
    for axis in axes.flat[len(operations) :]:
        axis.set_visible(False)
    for axis, operation in zip(axes.flat, operations):
        chosen = [row for row in rows if row["operation"] == operation and row["is_hard"] and row["seconds"]]
        chosen = [row for row in chosen if row.get("setting") is None and "judged" in row["errors"]]
        for name, look in _looks([row["contender"] for row in chosen]).items():
            mine = [row for row in chosen if row["contender"] == name]
            shares = [error_share(row) or ZERO_LANE for row in mine]
            rates = [row["rate"] for row in mine]
            axis.scatter(rates, shares, label=name, s=110 if name == "ours" else 30, zorder=3, **look)
        _log_axes(axis)
        axis.set(title=operation, **SHARES)
        low, high = axis.get_xlim()
        axis.set_xlim(min(low, high / 200), high)  # two decades at least: a tick to read each by
        axis.legend(fontsize=6.5, framealpha=0.0, loc="center left")
    for axis in axes[:, 0]:
        axis.set_ylabel("wrong or refused")
    for axis in axes[-1]:
        axis.set_xlabel("items a second")
    return _svg(figure)


def _curves(axis: Any, curves: dict[str, tuple[Any, Any]]) -> None:
    """Draw the places of each contender, both ways logarithmic."""
    looks = _looks(list(curves))
    for name, (x, y) in curves.items():
        axis.plot(x, y, label=name, ms=4, lw=2.5 if name == "ours" else 1.2, **looks[name])
    _log_axes(axis)
    axis.legend(fontsize=7, framealpha=0.0)


def _distance(found: dict[str, Any]) -> str:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 3.6), sharey=True)
    places = [max(ulps, 0.5) for ulps in found["ulps"]]
    for axis, operation in zip(axes, ("containment 2D", "containment 3D")):
        drawn = {name: (places, [share or ZERO_LANE for share in shares]) for name, shares in found[operation].items()}
        _curves(axis, drawn)
        axis.set(title=operation, xlabel="ulps of a coordinate off (leftmost: rounded onto it)", **SHARES)
    axes[0].set_ylabel("wrong answers")
    return _svg(figure)


def _size(found: dict[str, Any]) -> str:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 3.6), sharey=True)
    for axis, (kind, label) in zip(axes, (("faces", "faces of the mesh"), ("batch", "points in one call"))):
        _curves(axis, {name: tuple(zip(*places)) for name, places in found[kind].items()})
        axis.set_xlabel(label)
    axes[0].set_ylabel("points a second, containment 3D")
    return _svg(figure)


def _histograms(rows: list[dict[str, Any]]) -> str:
    """Errors of clipped coordinates in ulps, by powers of two."""
    import matplotlib.pyplot as plt

    chosen = [row for row in rows if row["is_hard"] and "ulp_histogram" in row["errors"]]
    contests = list(dict.fromkeys(row["contest"] for row in chosen))
    figure, axes = plt.subplots(1, len(contests), figsize=(11, 3.1), sharey=True, squeeze=False)
    for axis, contest in zip(axes[0], contests):
        mine = [row for row in chosen if row["contest"] == contest]
        looks = _looks([row["contender"] for row in mine])
        for i_row, row in enumerate(mine):
            counts = row["errors"]["ulp_histogram"]
            total, width = max(1, sum(counts)), 0.8 / len(mine)
            axis.bar([x + width * i_row for x in range(len(counts))], [count / total for count in counts],
                     width, color=looks[row["contender"]]["color"], label=row["contender"])  # fmt: skip
        axis.set(title=contest, yscale="log", ylim=(1e-4, 1.2), xlabel="ulps off")
        axis.set_xticks([0, 1, 3, 8, 14, 20], ["0", "1", "7", "255", "2$^{14}$", "more"])
        axis.legend(fontsize=6.5, framealpha=0.0)
    axes[0, 0].set_ylabel("share of coordinates")
    return _svg(figure)
