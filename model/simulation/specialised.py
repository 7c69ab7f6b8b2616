"""What a run is made of, chosen when it is compiled: by the type of a tag, so that compiled code can be cached.

numba caches nothing that is given a function as an argument. Tags are named tuples without meaning but their type; the
functions here have one implementation a type.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from model.dynamics.compilation import compiled

OPTIONS: Any = {"error_model": "numpy", "fastmath": {"contract"}}


class ClosedForm(NamedTuple):
    """The waist-shoulder-elbow arm of rods, rigid transmissions."""

    tag: int


class Flexible(NamedTuple):
    """The same arm where a transmission gives or has play."""

    tag: int


class AnyChain(NamedTuple):
    """Any machine, by the recursive form."""

    tag: int


class _Type(NamedTuple):
    """The type of a tag, as numba shows it to what chooses an implementation."""

    instance_class: type


def uncompiled(choose: Callable[..., Any], kind: Any, *arguments: Any) -> Any:
    """Does in Python what an overload would have compiled for a tag: for NUMBA_DISABLE_JIT=1, under which a run can be
    stepped through, and a fault in it is tried without the compiler."""
    return choose(_Type(type(kind)), *arguments)(kind, *arguments)


def entry(function: Callable[..., Any]) -> Any:
    """Compile an entry from Python: cached on disk, and other threads run beside it."""
    return compiled(function, nogil=True)
