"""Sutherland-Hodgman as one writes it in C++ with doubles, compiled here: what the arithmetic alone costs."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

import engine
from benchmarks.contenders import Prepared

NAMES = {"": "textbook: Sutherland-Hodgman in C++"}
SOURCE = r"""
#include <cmath>
#include <utility>
#include <vector>
struct Point { double x, y; };
using Ring = std::vector<Point>;

static void cut(const Ring& ring, Ring& kept, double a, double b, double c) {
    kept.clear();
    Point last = ring.back();
    double before = a * last.x + b * last.y + c;
    for (const Point& next : ring) {
        double after = a * next.x + b * next.y + c;
        if ((before >= 0) != (after >= 0)) {
            double t = before / (before - after);
            kept.push_back({last.x + t * (next.x - last.x), last.y + t * (next.y - last.y)});
        }
        if (after >= 0) kept.push_back(next);
        last = next;
        before = after;
    }
}

extern "C" void areas(const double* corners, long n_rings, long size, const double* rows, long n_rows, double* result) {
    Ring ring, kept;
    for (long i = 0; i < n_rings; ++i) {
        const Point* first = reinterpret_cast<const Point*>(corners) + i * size;
        ring.assign(first, first + size);
        for (long k = 0; k < n_rows && !ring.empty(); ++k) {
            cut(ring, kept, rows[3 * k], rows[3 * k + 1], rows[3 * k + 2]);
            std::swap(ring, kept);
        }
        double area = 0;
        for (size_t k = 1; k + 1 < ring.size(); ++k)
            area += (ring[k].x - ring[0].x) * (ring[k + 1].y - ring[0].y)
                  - (ring[k].y - ring[0].y) * (ring[k + 1].x - ring[0].x);
        result[i] = std::fabs(area) / 2;
    }
}
"""


@cache
def _library() -> ctypes.CDLL:
    compiler = next((found for name in ("g++", "clang++", "c++") if (found := shutil.which(name))), None)
    if compiler is None:
        raise OSError("no C++ compiler")
    with tempfile.TemporaryDirectory() as folder:
        source, built = Path(folder, "areas.cpp"), Path(folder, "areas.so")
        source.write_text(SOURCE)
        words = [compiler, "-O3", "-march=native", "-shared", "-fPIC", str(source), "-o", str(built)]
        subprocess.run(words, check=True, capture_output=True)
        return ctypes.CDLL(str(built))


def _areas(region: engine.Aabb, threads: int) -> Prepared:
    (x0, y0), (x1, y1) = region.min, region.max
    rows, library = np.array([[1, 0, -x0], [-1, 0, x1], [0, 1, -y0], [0, -1, y1]], float), _library()

    def ask(rings: np.ndarray) -> np.ndarray:
        result = np.empty(len(rings))
        rings = np.ascontiguousarray(rings)
        at = [array.ctypes.data_as(ctypes.c_void_p) for array in (rings, rows, result)]
        n_rings, size, n_rows = map(ctypes.c_long, (*rings.shape[:2], len(rows)))
        library.areas(at[0], n_rings, size, at[1], n_rows, at[2])
        return result

    return Prepared(ask)


MAKERS = {"polygon areas": _areas}
