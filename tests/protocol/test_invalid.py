"""What pydantic refuses, in one line: where, what is wrong, and nothing of pydantic's own words."""

from typing import Annotated, Any

import pytest
from pydantic import BaseModel, Field, ValidationError, field_validator

from firmware_protocol.invalid import Invalid, first_invalid


class Part(BaseModel):
    size: Annotated[float, Field(le=2.0)]


class Whole(BaseModel):
    parts: tuple[Part, ...]
    name: str = ""

    @field_validator("name")
    @classmethod
    def _no_blanks(cls, name: str) -> str:
        if " " in name:
            raise ValueError("a name has no blanks")
        return name


def refused(data: Any) -> Invalid:
    with pytest.raises(ValidationError) as caught:
        Whole.model_validate(data)
    return first_invalid(caught.value)


def test_the_first_wrong_value_is_told_with_its_place_its_rule_and_its_bounds() -> None:
    found = refused({"parts": [{"size": 1}, {"size": 3}], "name": "a b"})
    assert (found.where(), found.where(first=1)) == ("parts.1.size", "parts.2.size")
    assert (found.value, found.kind, found.bounds) == (3, "less_than_equal", {"le": 2.0})


def test_data_that_are_wrong_as_a_whole_have_the_name_that_the_caller_gives_them() -> None:
    assert refused(1).where("file") == "file"
