"""What most people would write: FastAPI with a pydantic model, and nothing around it. A server of its own.

python -m benchmarks.contenders.plain_fastapi PORT
"""

from __future__ import annotations

import sys

import numpy as np
import uvicorn
from fastapi import FastAPI
from pydantic import BaseModel

import engine
from service.schemas.points import ContainsRequest

app = FastAPI()


class PlainRequest(BaseModel):
    """A ball and points as lists of tuples."""

    center: tuple[float, float, float]
    radius: float
    points: list[tuple[float, float, float]]


@app.post("/plain")
async def plain(question: PlainRequest) -> dict[str, list[bool]]:
    """Answer in the way of FastAPI's tutorial, on the event loop."""
    sphere = engine.Sphere(question.center, question.radius)
    return {"contained": engine.contains(np.array(question.points), sphere).tolist()}


@app.post("/same-model")
async def same_model(question: ContainsRequest) -> dict[str, list[bool]]:
    """Answer with the service's own model, without limits, ids or metrics."""
    sphere = engine.Sphere(question.solid.root.center, question.solid.root.radius)  # type: ignore[union-attr]
    return {"contained": engine.contains(question.points, sphere).tolist()}


if __name__ == "__main__":
    uvicorn.run(app, host="127.0.0.1", port=int(sys.argv[1]), log_level="warning", access_log=False)
