"""Equality of data classes with arrays, which `==` alone cannot compare."""

from __future__ import annotations

from dataclasses import fields

import numpy as np


class WithArrays:
    """A data class, made with `eq=False`. It equals another of its class if all compared fields are equal; arrays are
    compared element by element. It is hashable."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(_same(getattr(self, name), getattr(other, name)) for name in self._compared())

    def __hash__(self) -> int:
        values = [getattr(self, name) for name in self._compared()]
        return hash((type(self), *(value.shape for value in values if isinstance(value, np.ndarray))))

    def _compared(self) -> list[str]:
        return [one.name for one in fields(self) if one.compare]  # type: ignore[arg-type]


def _same(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    return type(one) is type(other) and bool(one == other)
