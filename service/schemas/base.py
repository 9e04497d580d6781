"""What all models share, fields that are left out, lists as long as a setting allows; errors (RFC 9457), accuracy."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError, core_schema

from service.schemas.arrays import LIMIT, Fault, Numbers, limit_sentence

_STEP: Final = 256
"""Items checked at once: pydantic lets no other thread run while it lists what is wrong with them."""


class AtMost:
    """Annotation of a list of models: no longer than the setting of this name, counted before any item is looked at.

    Nothing is said of items long after the first that is wrong.
    """

    def __init__(self, name: str, low: int = 0) -> None:
        self.name = name
        self.low = low

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.with_info_wrap_validator_function(self._validate, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        document = handler(schema)
        if self.low:
            document["minItems"] = self.low
        document[LIMIT] = self.name
        return document

    def _validate(
        self, value: Any, handler: core_schema.ValidatorFunctionWrapHandler, info: core_schema.ValidationInfo
    ) -> Any:
        if not isinstance(value, (list, np.ndarray)):
            return handler(value)
        limit = None if info.context is None else getattr(info.context.settings, self.name)
        if limit is not None and len(value) > limit:
            fault = Fault((), "limit_exceeded", limit_sentence(self.name, limit, len(value)))
        elif len(value) < self.low:
            fault = Fault((), "empty_geometry", f"the list holds {len(value)} items; at least {self.low} are needed")
        else:
            return self._checked(list(value) if isinstance(value, np.ndarray) else value, handler)
        raise PydanticCustomError("numbers", "{detail}", {"detail": fault.detail, "faults": [fault]})

    def _checked(self, items: list[Any], handler: core_schema.ValidatorFunctionWrapHandler) -> list[Any]:
        result: list[Any] = []
        for start in range(0, max(1, len(items)), _STEP):
            try:
                result += handler(items[start : start + _STEP])
            except ValidationError:
                handler(items[: start + _STEP])  # raises too, with their places in the whole list
                raise
        return result


def _without_default(schema: dict[str, Any]) -> None:
    schema.pop("default", None)


def optional(description: str | None = None, examples: list[Any] | None = None) -> Any:
    """Return a field that may be left out and is then None; JSON ``null`` is refused, and the schema has no default."""
    return Field(default=None, description=description, examples=examples, json_schema_extra=_without_default)


_MOST_FIELDS: Final = 64
"""Fields that are looked at one by one; no model has half as many."""
Count = Annotated[int, Numbers(kind="integer", minimum=0)]


class Schema(BaseModel):
    """Base of all models: nothing is converted (``"1.5"`` and ``true`` are no numbers), unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", strict=True)

    @model_validator(mode="before")
    @classmethod
    def _has_few_fields(cls, value: Any) -> Any:
        """Refuse a body of thousands of unknown fields at once: pydantic makes an error of each."""
        if isinstance(value, dict) and len(value) > _MOST_FIELDS:
            detail = f"the object has {len(value)} fields, most are not known here; /docs has an example"
            raise PydanticCustomError(
                "numbers", "{detail}", {"detail": detail, "faults": [Fault((), "unknown_field", detail)]}
            )
        return value

    @classmethod
    def made(cls, **fields: Any) -> Self:
        """Return an answer of these fields, unchecked, for `wire.encode` only: pydantic's own way takes six times as
        long, for what an answer never uses."""
        answer = cls.__new__(cls)
        answer.__dict__.update(fields)
        return answer


def with_example(*examples: dict[str, Any]) -> ConfigDict:
    """Return the configuration of a model that shows examples: of a question, which a test asks, or of the answers to
    them, which it holds against what comes. Their parts are the examples of the properties (openapi.py)."""
    return ConfigDict(json_schema_extra={"examples": [*examples]})


class ProblemItem(Schema):
    """One place in the request and what is wrong with it."""

    pointer: str = Field(description="JSON pointer (RFC 6901) into the request body; empty for the body as a whole.")
    detail: str = Field(description="What was expected there, what came, and what to do.")


class Problem(Schema):
    """An error (RFC 9457, `application/problem+json`)."""

    model_config = with_example(
        {
            "type": "urn:exact-geometry:problem:min_above_max",
            "title": "Unprocessable Entity",
            "status": 422,
            "detail": "min[2] = 2.0 is above max[2] = 1.0; swap them",
            "code": "min_above_max",
            "errors": [{"pointer": "/solid/min/2", "detail": "min[2] = 2.0 is above max[2] = 1.0; swap them"}],
        }
    )

    type: str = Field(description="URI of this kind of problem.")
    title: str = Field(description="The status in words.")
    status: Annotated[int, Numbers(kind="integer", minimum=400)] = Field(description="The status of the answer.")
    detail: str = Field(description="What was expected, what came, where, and what to do.")
    code: str = Field(description="Stable name of the rule that was broken.")
    errors: list[ProblemItem] = Field(description="The places at fault, at most 20.", max_length=20)


class Accuracy(Schema):
    """What this answer can say of its own accuracy."""

    model_config = with_example(
        {
            "decisions": "exact",
            "coordinates_ulp": 0.5,
            "items": 3,
            "beyond_filter": 2,
            "rational": 0,
            "method": "sphere",
        }
    )

    decisions: Literal["exact", "float64"] = Field(description="How every decision was made.")
    coordinates_ulp: Annotated[float, Numbers()] = optional(
        "Bound on each constructed coordinate in units in the last place; left out where none is constructed."
    )
    items: Count = Field(description="Items asked for.")
    beyond_filter: Count = Field(description="Items that the floating-point filter left open.")
    rational: Count = Field(description="Items of those that needed rational arithmetic.")
    method: str = Field(description="The method chosen.")
    notes: list[str] = optional(
        "What of the question was left out, as altitudes of GeoJSON are.",
        [["polygons: altitudes, the third numbers of GeoJSON's positions, are left out of a question of the plane"]],
    )
