"""The drawings of docs/hard_cases.md: one small SVG a family, without background, in tones for light and dark pages."""

from __future__ import annotations

import math
from collections.abc import Sequence

GREY, HOT, COLD = "#8a9099", "#d9480f", "#1c7ed6"
"""Bodies and words; what is critical; the second body."""
WIDTH, HEIGHT = 260, 130
Point = tuple[float, float]


def shape(points: Sequence[Point], color: str = GREY, is_open: bool = False, fill: float = 0.15) -> str:
    """Return a polygon, or an open line."""
    places = " ".join(f"{x:g},{y:g}" for x, y in points)
    inside = "none" if is_open else color
    kind = "polyline" if is_open else "polygon"
    return f'<{kind} points="{places}" stroke="{color}" fill="{inside}" fill-opacity="{fill}" fill-rule="evenodd"/>'


def line(a: Point, b: Point, color: str = HOT, dashes: bool = False) -> str:
    more = ' stroke-dasharray="4 3"' if dashes else ""
    return f'<line x1="{a[0]:g}" y1="{a[1]:g}" x2="{b[0]:g}" y2="{b[1]:g}" stroke="{color}"{more}/>'


def dot(x: float, y: float, color: str = HOT) -> str:
    return f'<circle cx="{x:g}" cy="{y:g}" r="3.2" fill="{color}"/>'


def circle(x: float, y: float, radius: float, color: str = GREY) -> str:
    return f'<circle cx="{x:g}" cy="{y:g}" r="{radius:g}" stroke="{color}" fill="{color}" fill-opacity="0.15"/>'


def word(x: float, y: float, text: str, color: str = GREY) -> str:
    return f'<text x="{x:g}" y="{y:g}" fill="{color}" stroke="none">{text}</text>'


def box(x: float, y: float, width: float, height: float, color: str = GREY) -> str:
    return shape([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], color)


def turned(points: Sequence[Point], degrees: float, about: Point) -> list[Point]:
    """Return the points turned about one."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return [
        (about[0] + c * (x - about[0]) - s * (y - about[1]), about[1] + s * (x - about[0]) + c * (y - about[1]))
        for x, y in points
    ]


CORNER = [(70, 20), (190, 20), (190, 70), (130, 70), (130, 110), (70, 110)]
STAR = [(130 + 52 * math.sin(4 * math.pi * k / 5), 68 - 52 * math.cos(4 * math.pi * k / 5)) for k in range(5)]
COMB = [(60, 105), (60, 25), (80, 25), (80, 85), (105, 85), (105, 25), (125, 25), (125, 85), (150, 85), (150, 25),
        (170, 25), (170, 105)]  # fmt: skip
RING = [(130 + 52 * math.cos(k * math.pi / 4), 65 + 52 * math.sin(k * math.pi / 4)) for k in range(8)]
FRAME = turned([(90, 35), (170, 35), (170, 75), (90, 75)], -20, (130, 70))
TOP = turned([(105, 5), (155, 5), (155, 35), (105, 35)], -20, (130, 70))

DRAWINGS: dict[str, list[str]] = {
    "on_the_boundary": [shape(CORNER), dot(70, 20), dot(130, 70), dot(190, 45), dot(100, 110),
                        word(196, 48, "edge"), word(26, 24, "vertex")],
    "ray_through_a_vertex": [shape([(110, 20), (190, 65), (110, 110), (150, 65)]), dot(60, 65),
                             line((60, 65), (235, 65)), dot(60, 20), line((60, 20), (235, 20)),
                             word(196, 60, "one or two?")],
    "one_ulp": [line((20, 105), (240, 25), GREY),
                *(dot(x, y, GREY) for x in range(50, 230, 30) for y in range(22, 125, 17)), dot(140, 56),
                word(40, 14, "on the line, or less than an ulp beside it?", HOT)],
    "far_and_tiny": [box(20, 55, 160, 60), box(214, 20, 5, 5, HOT),
                     word(195, 16, "1e-300", HOT), word(80, 90, "1e300")],
    "needles": [shape([(15, 66), (245, 60), (245, 62)]), shape([(15, 90), (245, 90)], GREY, True), dot(120, 90),
                shape([(60, 30), (200, 30), (200, 34)]), dot(150, 62.6), word(100, 112, "no area, or next to none")],
    "even_odd": [shape(STAR), dot(130, 68), word(190, 72, "out"), line((136, 68), (186, 68), HOT, True),
                 dot(130, 26), word(150, 24, "in")],
    "nested": [box(50, 12, 160, 106), box(105, 42, 50, 46, COLD), word(75, 34, "no faces meet")],
    "touching": [box(30, 40, 50, 50), shape([(80, 40), (105, 65), (105, 15)], COLD), dot(80, 40), box(140, 60, 50, 50),
                 box(165, 30, 40, 30, COLD), line((165, 60), (190, 60))],
    "edges_only": [box(35, 50, 190, 30), box(115, 12, 30, 106, COLD), dot(115, 50), dot(145, 50), dot(115, 80),
                   dot(145, 80), word(150, 20, "no vertex inside")],
    "coplanar": [box(60, 80, 140, 30), box(60, 50, 90, 30, COLD), box(80, 20, 70, 30), line((60, 80), (150, 80)),
                 line((80, 50), (150, 50))],
    "without_interior": [box(60, 30, 140, 75), line((30, 70), (230, 50)), word(204, 45, "a surface")],
    "posed": [shape(FRAME), shape(TOP, COLD), line(FRAME[0], FRAME[1]), word(180, 110, "R p + t")],
    "through_a_corner": [box(90, 35, 100, 70), line((60, 14), (150, 77)), dot(90, 35), line((160, 20), (220, 50), HOT),
                         dot(190, 35), word(24, 40, "kept?")],
    "tangent": [circle(130, 75, 45), line((40, 30), (225, 30)), dot(130, 30), line((40, 29), (225, 33), COLD)],
    "several_pieces": [shape(COMB), line((30, 45), (200, 45)), line((30, 25), (200, 25), COLD),
                       word(205, 48, "3 pieces")],
    "on_the_planes": [shape([(70, 110), (70, 15), (190, 15), (190, 110), (160, 110), (160, 60), (100, 60), (100, 110)]),
                      line((30, 60), (235, 60)), word(200, 55, "plane"), line((100, 60), (160, 60), COLD)],
    "coincident_edges": [shape([(40, 25), (130, 20), (130, 110), (40, 105)]),
                         shape([(130, 20), (220, 25), (220, 105), (130.8, 110)], COLD), line((130, 20), (130.4, 110)),
                         word(138, 70, "an ulp apart", HOT)],
    "on_and_on": [box(50, 30, 80, 70), box(130, 30, 80, 70, COLD), line((130, 30), (130, 100)), dot(130, 65),
                  word(137, 62, "in the union?", HOT)],
    "cospherical": [circle(130, 65, 52), *(dot(*place) for place in RING), dot(130, 65, COLD)],
}  # fmt: skip


def draw() -> dict[str, str]:
    """Return the SVG text of every drawing."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        'stroke-width="1.6" font-family="sans-serif" font-size="11">\n'
    )
    return {name: head + "\n".join(parts) + "\n</svg>\n" for name, parts in DRAWINGS.items()}
