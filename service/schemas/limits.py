"""Fields that are left out rather than null, and lists whose longest length is a setting."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError
from pydantic_core import PydanticCustomError, core_schema

from service.schemas.arrays import LIMIT, Fault, limit_sentence

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
        found: list[Any] = []
        for start in range(0, max(1, len(items)), _STEP):
            try:
                found += handler(items[start : start + _STEP])
            except ValidationError:
                handler(items[: start + _STEP])  # raises too, with their places in the whole list
                raise
        return found


def _without_default(schema: dict[str, Any]) -> None:
    schema.pop("default", None)


def left_out(description: str | None = None, examples: list[Any] | None = None) -> Any:
    """Return a field that may be left out and is then None; JSON ``null`` is refused, and the schema has no default."""
    return Field(default=None, description=description, examples=examples, json_schema_extra=_without_default)
