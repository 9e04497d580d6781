"""Seeded segments of every awkward family around a region, and the comparison with the rational reference."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

import engine
from engine.running.budget import Budget
from engine.segment_clipping.clip_segments import SegmentPieces, clip_segments
from engine.segment_clipping.pieces import Piece
from engine.segment_clipping.profiles import exact_pieces
from engine.solids.base import Solid
from engine.solids.csg import Csg
from engine.solids.mesh import Polyhedron, Surface
from engine.solids.polygon import Polygon
from engine.solids.primitives import Aabb, Convex, HalfSpace, Sphere, Triangle
from tests.reference.segments import clip_segments as reference_pieces

Floats = Any


def as_json(solid: Solid) -> dict[str, Any]:
    """Return the region as the reference reads it."""
    match solid:
        case HalfSpace():
            return {"type": solid.type, "normal": solid.normal.tolist(), "offset": solid.offset}
        case Aabb():
            return {"type": solid.type, "min": solid.min.tolist(), "max": solid.max.tolist()}
        case Convex():
            return {"type": solid.type, "planes": solid.planes.tolist()}
        case Sphere():
            return {"type": solid.type, "center": solid.center.tolist(), "radius": solid.radius}
        case Polygon():
            pairs = zip(solid.ring_offsets, solid.ring_offsets[1:])
            return {"type": solid.type, "rings": [solid.vertices[i:j].tolist() for i, j in pairs]}
        case Triangle():
            return {"type": solid.type, "vertices": solid.vertices.tolist()}
        case Csg():
            operands = [as_json(operand) for operand in solid.operands]
            return {"type": solid.type, "operation": solid.operation, "operands": operands}
        case Polyhedron() | Surface():
            pairs = zip(solid.face_offsets, solid.face_offsets[1:])
            faces = [solid.face_indices[i:j].tolist() for i, j in pairs]
            return {"type": solid.type, "vertices": solid.vertices.tolist(), "faces": faces}
    raise TypeError(solid.type)


def assert_exact(pieces: SegmentPieces, segments: Floats, region: Solid) -> None:
    """Assert that `pieces` are the reference's: every source, every double, every face."""
    expected = reference_pieces(segments.tolist(), as_json(region))
    found = [
        (int(s), a.tolist(), b.tolist(), t.tolist())
        for s, a, b, t in zip(pieces.source, pieces.start, pieces.end, pieces.t)
    ]
    assert found == [(source, *piece.rounded()) for source, piece in expected]
    assert not any(np.signbit(array[array == 0.0]).any() for array in (pieces.start, pieces.end, pieces.t))
    assert [tuple(faces) for faces in pieces.faces.tolist()] == [piece.faces for _, piece in expected]


def check(segments: Floats, region: Solid) -> None:
    segments = np.asarray(segments, np.float64)
    assert_exact(clip_segments(segments, region), segments, region)


def assert_same_uncompiled(test: str) -> None:
    """Assert that a test's `uncompiled_sample` passes with the kernels as plain Python, in a process of its own."""
    root, code = Path(engine.__file__).resolve().parents[1], f"import {test} as t; t.uncompiled_sample()"
    environment = {"NUMBA_DISABLE_JIT": "1", "PATH": "", "PYTHONPATH": str(root)}
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], cwd=root, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr


def nudged(rng: np.random.Generator, values: Floats, steps: int = 4) -> Floats:
    """Return every number moved by up to `steps` units in the last place, about half of them not at all."""
    ulps = rng.integers(-steps, steps + 1, values.shape) * rng.integers(0, 2, values.shape)
    return values + ulps * np.spacing(values)


def random_segments(rng: np.random.Generator, n: int, dimension: int) -> Floats:
    return rng.uniform(-2, 2, (n, 2, dimension))


def lattice_segments(rng: np.random.Generator, n: int, dimension: int, size: int = 3) -> Floats:
    """Return end points on a small lattice: ends on planes, segments in faces, through corners, points."""
    return rng.integers(-size, size + 1, (n, 2, dimension)).astype(np.float64)


def through(rng: np.random.Generator, targets: Floats, n: int) -> Floats:
    """Return segments whose line passes through a target, exactly or nearly, within it or ending at it."""
    dimension = targets.shape[1]
    target = targets[rng.integers(0, len(targets), n)]
    direction = np.where(
        rng.random((n, 1)) < 0.5, rng.uniform(-1, 1, (n, dimension)), rng.integers(-2, 3, (n, dimension))
    )
    before, after = rng.choice([0.0, 0.5, 1.0, 3.0], (2, n, 1))
    return nudged(rng, np.stack([target - before * direction, target + after * direction], axis=1))


def families(rng: np.random.Generator, targets: Floats, n: int) -> dict[str, Floats]:
    """Return n segments of each family, for regions of the size of a unit around the origin."""
    dimension = targets.shape[1]
    return {
        "random": random_segments(rng, n, dimension),
        "lattice": lattice_segments(rng, n, dimension),
        "targets": through(rng, targets, n),
        "chords": targets[rng.integers(0, len(targets), (n, 2))],
        "tiny": 1e-9 * random_segments(rng, n, dimension) + targets[rng.integers(0, len(targets), n)][:, None, :],
        "long": 1e9 * random_segments(rng, n, dimension),
        "mixed": random_segments(rng, n, dimension) * 10.0 ** rng.integers(-300, 300, (n, 2, dimension)),
        "denormal": random_segments(rng, n, dimension) * 5e-324 * 100,
    }


def settled_alone(p: list[float], q: list[float], solid: Any) -> Piece | None:
    """Return the one piece of p q within a convex solid by exact arithmetic, None where there is none."""
    with Budget() as budget:
        found = [piece.rounded(p, q) for piece in exact_pieces(p, q, solid, None, budget)]
    return found[0] if found else None
