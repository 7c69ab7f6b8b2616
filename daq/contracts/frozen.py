"""Base classes of the data in files and messages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast, dataclass_transform

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from daq.contracts.errors import SpecError
from firmware_protocol.invalid import first_invalid

WHEN_USED = ConfigDict(defer_build=True)
"""For a `TypeAdapter`: pydantic builds its validator on first use, as it does for `FrozenRecord`."""


Record = TypeVar("Record", bound=BaseModel)


def like(kind: type[Record], source: object, /, **others: Any) -> Record:
    """Returns a record of `kind` with the attributes of `source` that have the names of its fields. `others`: its
    fields that differ."""
    own = {name: getattr(source, name) for name in kind.model_fields if name not in others and hasattr(source, name)}
    return kind.model_validate(own | others)


class FrozenRecord(BaseModel):
    """Immutable named values. Unknown fields are rejected, never ignored."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    shown: ClassVar[tuple[str, ...]] = ()
    """Fields and properties shown by `repr`, for records that would fill a page; empty for all fields."""

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


# Type checkers without pydantic's plug-in read the arguments of a record only where its own metaclass says this.
@dataclass_transform(kw_only_default=True, field_specifiers=(Field,))
class _OneLine(_OfPydantic):
    """Turns a ValidationError of a direct call into a one-line SpecError. Data that are read or sent are still
    validated by their readers."""

    def __call__(cls, *given: Any, **named: Any) -> Any:  # noqa: N805 - of a metaclass
        try:
            return super().__call__(*given, **named)
        except ValidationError as error:
            words = cast("type[UserRecord]", cls).words_of(error)
            raise SpecError(f"{cls.__name__}: {words}") from None


class UserRecord(FrozenRecord, metaclass=_OneLine):
    """A record that users construct in Python. Raises a one-line SpecError for invalid values."""

    @classmethod
    def words_of(cls, error: ValidationError) -> str:
        """States what is wrong, where, and what is allowed."""
        first = first_invalid(error)
        return f"{first.where('arguments')}: {first.message} (got {first.value!r:.80})"


def build_records() -> None:
    """Builds the validators of all loaded records, which takes some ms each. A time-critical process calls this at its
    start, so that no validator is built on first use."""
    kinds: list[type[FrozenRecord]] = [FrozenRecord]
    for kind in kinds:  # in order of definition: the parts of a record are built before it
        kinds += kind.__subclasses__()
        kind.model_rebuild()
