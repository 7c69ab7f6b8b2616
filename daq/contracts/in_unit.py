"""Adds the unit to error messages about a number's bounds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

BOUNDS = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
"""Pydantic's names of the errors for a number outside its bounds."""


@dataclass(frozen=True)
class InUnit:
    """Marks a field, after its bounds: `Annotated[float, Field(gt=0), InUnit("s")]`."""

    unit: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Adds the unit to errors about the bounds."""
        return core_schema.no_info_wrap_validator_function(self._told, handler(source))

    def _told(self, value: Any, validate: Callable[[Any], Any]) -> Any:
        try:
            return validate(value)
        except ValidationError as error:
            first = error.errors()[0]
            if first["type"] not in BOUNDS:
                raise
            raise PydanticCustomError(first["type"], f"{first['msg']} {self.unit}", first.get("ctx")) from None
