"""What does exactness cost and save on a question, against the textbook's plain float64 method?"""

from __future__ import annotations

from typing import Any

import engine
from service.convert import answers, questions
from service.routes.base import router_of
from service.schemas.compare import NEEDED, CompareRequest, CompareResponse
from service.work import CallOf

router = router_of("compare")


@router.post("/v1/compare", operation_id="compare")
def compare(question: CompareRequest, call: CallOf) -> CompareResponse:
    """Answer exactly and by the textbook's method; say where they differ and how long both took."""
    names = NEEDED[question.operation]
    values = [getattr(question, name) for name in names]
    solid = questions.to_solid(values[1], call, names[1:])
    if question.operation == "collide":
        items: Any = questions.to_solid(values[0], call, names[:1])
    else:
        items = questions.to_items(values[0], solid.dimension)
    found, accuracy = call.compute(_compared, question.operation, items, solid, method=question.method)
    return answers.from_comparison(found, accuracy)


def _compared(*arguments: Any, report: bool, **options: Any) -> tuple[engine.Comparison, engine.Accuracy]:
    found = engine.compare(*arguments, **options)
    return found, found.accuracy
