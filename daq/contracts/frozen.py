"""Data that files and messages are made of."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, cast

from pydantic import BaseModel, ConfigDict, ValidationError

from daq.contracts.errors import SpecError
from firmware_protocol.invalid import first_invalid

WHEN_USED = ConfigDict(defer_build=True)
"""For a `TypeAdapter`: pydantic builds what checks it when that is used first, as it does for `FrozenRecord`s."""


class FrozenRecord(BaseModel):
    """Named values that do not change once made. Unknown ones are refused, never ignored."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    shown: ClassVar[tuple[str, ...]] = ()
    """Fields and properties that `repr` shows, for records that would fill a page; empty for all fields."""

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        if self.shown:
            return ((name, getattr(self, name)) for name in self.shown)
        return iter(super().__repr_args__())

    def __dir__(self) -> list[str]:
        """Its own names: a notebook's completion shows fields and methods of the record, and none of pydantic's."""
        left_out = {name for name in dir(BaseModel) if not name.startswith("__")} - type(self).model_fields.keys()
        return [name for name in super().__dir__() if name not in left_out]


if TYPE_CHECKING:  # pydantic gives its metaclass no public name
    from pydantic._internal._model_construction import ModelMetaclass as _OfPydantic
else:
    _OfPydantic = type(FrozenRecord)


class _OneLine(_OfPydantic):
    """Turns what pydantic refuses of a direct call into one line. Data that are read or sent are checked as before, by
    whoever reads them."""

    def __call__(cls, *given: Any, **named: Any) -> Any:  # noqa: N805 - of a metaclass
        try:
            return super().__call__(*given, **named)
        except ValidationError as error:
            words = cast("type[SpokenRecord]", cls).words_of(error)
            raise SpecError(f"{cls.__name__}: {words}") from None


class SpokenRecord(FrozenRecord, metaclass=_OneLine):
    """A record that people make in their programs. Raises SpecError, in one line, for values that are refused."""

    @classmethod
    def words_of(cls, error: ValidationError) -> str:
        """What is wrong, where, and what is allowed."""
        first = first_invalid(error)
        return f"{first.where('arguments')}: {first.message} (got {first.value!r:.80})"


def build_records() -> None:
    """Builds what checks each record that is loaded. A process that keeps time, or stops the arm, does so before it
    begins: to build one takes some ms, which it would otherwise take when it is used first."""
    kinds: list[type[FrozenRecord]] = [FrozenRecord]
    for kind in kinds:  # in the order in which they were made: what a record consists of is built before it
        kinds += kind.__subclasses__()
        kind.model_rebuild()
