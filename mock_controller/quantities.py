"""Reads quantities with unit and source from the mock's TOML data files.

A data file's leaf is `{ value = 0.5, unit = "kg", source = "documented: table 7.9" }`. The reader knows the required
unit, so a file in millimetres or degrees is rejected and never silently misread.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from typing import Literal


class DataFileError(ValueError):
    """A data file of the mock that cannot be used; the message says where and what is allowed."""


@dataclass(frozen=True)
class Provenance:
    """Source of one value."""

    name: str
    value: float
    unit: str
    kind: Literal["documented", "assumed"]
    note: str


class QuantityReader:
    """Takes quantities from one parsed data file; `finish` rejects entries that were not taken."""

    def __init__(self, text: str, origin: str) -> None:
        self._origin = origin
        self._taken: set[str] = set()
        self.provenance: list[Provenance] = []
        try:
            self._tables = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise DataFileError(f"{origin}: not TOML: {error}") from error
        except RecursionError:
            raise DataFileError(f"{origin}: is nested too deeply") from None

    def take(self, table: str, key: str, unit: str, low: float = -math.inf, high: float = math.inf) -> float:
        """Returns the value of `[table] key` in `unit`, between `low` and `high`. Raises DataFileError."""
        name = f"{table}.{key}"
        section = self._tables.get(table)
        leaf = section.get(key) if isinstance(section, dict) else None
        if not isinstance(leaf, dict) or leaf.keys() != {"value", "unit", "source"}:
            raise DataFileError(f'{self._origin}: {name}: must be {{ value = …, unit = "{unit}", source = … }}')
        value, source = leaf["value"], str(leaf["source"])
        if leaf["unit"] != unit:
            raise DataFileError(f"{self._origin}: {name}: unit is {leaf['unit']!r}, must be {unit!r}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise DataFileError(f"{self._origin}: {name}: value is {value}, allowed are {low} to {high} {unit}")
        kind, _, note = source.partition(":")
        if kind not in ("documented", "assumed") or not note.strip():
            raise DataFileError(
                f"{self._origin}: {name}: source must be 'documented: where' or 'assumed: why', is {source!r}"
            )
        self._taken.add(name)
        known: Literal["documented", "assumed"] = "documented" if kind == "documented" else "assumed"
        self.provenance.append(Provenance(name, float(value), unit, known, note.strip()))
        return float(value)

    def take_int(self, table: str, key: str, unit: str, low: int, high: int) -> int:
        """Returns a whole number, as `take` does."""
        value = self.take(table, key, unit, low, high)
        if value != int(value):
            raise DataFileError(f"{self._origin}: {table}.{key}: value is {value}, must be a whole number")
        return int(value)

    def finish(self) -> None:
        """Raises DataFileError for the first table or key that was never taken: probably a misspelling."""
        for table, section in self._tables.items():
            if not isinstance(section, dict):
                raise DataFileError(f"{self._origin}: {table}: is not a table")
            for key in section:
                if f"{table}.{key}" not in self._taken:
                    raise DataFileError(f"{self._origin}: {table}.{key}: not a quantity of this file")
