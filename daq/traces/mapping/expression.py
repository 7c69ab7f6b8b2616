"""Expressions for a signal: a column or a weighted sum of columns; {} is replaced by each joint.

q{}                          the columns q1, q2 …, one per joint
0.125*pwm_percent            a column times a number
0.25*a - 0.5*b + 1.57        a sum; + and - need spaces on both sides
pos_left, pos_right          the first column for the first joint, the second for the second
#                            the row number, from 0
int16(load)                  a 16-bit count, read as signed
positions[2::7]              every seventh value, from the third on
currents.csv:Joint_{}        columns of another file in the same folder, with as many rows
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.documents import shown
from daq.contracts.errors import TraceError
from daq.contracts.trace import Floats

Columns = dict[str, Floats]
"""Columns (n,) by name; a value that is not a number is NaN."""
SHOWN = 20
"""Most columns that an error lists."""
_NUMBER = r"[0-9.]+(?:[eE][-+]?[0-9]+)?"
_TERM = re.compile(rf"(-)?(?:({_NUMBER})\s*\*\s*)?(.+)", re.DOTALL)
_EVERY = re.compile(r"(.+)\[(\d+|\{\})::(\d+)\]")


@dataclass(frozen=True)
class Table:
    """The columns of a file, and a reader for files beside it."""

    origin: str
    columns: Columns
    beside: Callable[[str], Columns] | None = None

    def value(self, expression: str) -> Floats:
        """Returns the values (n,) of an expression without {}. Raises TraceError."""
        text = expression.strip()
        if text in self.columns:
            return self.columns[text]
        total: Floats | float = 0.0
        parts = re.split(r"\s+([+-])\s+", text)
        for sign, term in zip(["+", *parts[1::2]], parts[::2], strict=True):
            total = total + (-1.0 if sign == "-" else 1.0) * self._term(term)
        if isinstance(total, float):
            raise TraceError(f"{self.origin}: {shown(text)} is not a column; the file has {self.listed()}")
        return np.asarray(total, np.float64)

    def _term(self, term: str) -> Floats | float:
        if term in self.columns:
            return self.columns[term]
        if re.fullmatch(f"-?{_NUMBER}", term) and _is_number(term):
            return float(term)
        match = _TERM.fullmatch(term)
        if match is None or not _is_number(match[2] or "1"):
            raise TraceError(f"{self.origin}: {shown(term)} is not a column, number, or number*column")
        return (-1.0 if match[1] else 1.0) * float(match[2] or 1.0) * self._column(match[3])

    def _column(self, name: str) -> Floats:
        if name in self.columns:
            return self.columns[name]
        if name == "#":
            return np.arange(max((len(c) for c in self.columns.values()), default=0), dtype=np.float64)
        if name.startswith("int16(") and name.endswith(")"):
            counts = self._column(name[6:-1])
            return np.where(counts >= 2**15, counts - 2**16, counts)
        if (every := _EVERY.fullmatch(name)) is not None and every[1] in self.columns and int(every[3]) > 0:
            return self.columns[every[1]][int(every[2]) :: int(every[3])]
        file, colon, there = name.partition(":")
        if colon and self.beside is not None:
            return Table(file, self.beside(file)).value(there)
        raise TraceError(f"{self.origin}: column {shown(name)} is missing; the file has {self.listed()}")

    def listed(self) -> str:
        """Names of the columns, for an error."""
        return listed(tuple(self.columns))

    def tokens(self, pattern: str) -> tuple[str, ...]:
        """Returns the values of {} in the first name of a pattern, in the order of the columns (of numbers if they
        are).

        Raises TraceError if no column matches.
        """
        if whole := tokens_in(pattern.strip(), self.columns):  # a column's own name may look like a sum
            return whole
        terms = [_TERM.fullmatch(term) for term in re.split(r"\s+[+-]\s+", pattern.strip())]
        name = next((term[3] for term in terms if term is not None and "{}" in term[3]), pattern)
        name = name.removeprefix("int16(").removesuffix(")") if name.startswith("int16(") else name
        if (every := _EVERY.fullmatch(name)) is not None and every[2] == "{}":
            return tuple(str(index) for index in range(int(every[3])))
        file, colon, there = name.partition(":")
        beside = colon and self.beside is not None and not any(colon in column for column in self.columns)
        columns = self.beside(file) if beside and self.beside is not None else self.columns
        found = tokens_in(there if beside else name, columns)
        if not found:
            raise TraceError(f"{self.origin}: no column matches {shown(name)}; the file has {listed(tuple(columns))}")
        return found


def tokens_in(name: str, columns: Sequence[str] | Columns) -> tuple[str, ...]:
    """Returns the values of {} in the columns that match a name."""
    before, _, after = name.partition("{}")
    form = re.compile(re.escape(before) + r"(.+?)" + re.escape(after).replace(re.escape("{}"), r"\1"), re.DOTALL)
    found = [match[1] for column in columns if (match := form.fullmatch(column)) is not None]
    numbers = [token for token in found if token.isdecimal()]
    return tuple(sorted(numbers, key=int)) if numbers else tuple(found)


def listed(names: Sequence[str]) -> str:
    """Lists the first of many names, for an error."""
    told = ", ".join(shown(name).strip("'") for name in names[:SHOWN])
    return told + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
