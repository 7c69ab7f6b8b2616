"""Chooses the parts of a run at compile time by the type of a tag, so that compiled code can be cached.

numba cannot cache a function that takes functions as arguments. Tags are named tuples that matter only by their type;
each function here has one implementation per type.
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
    """The same arm with a flexible transmission or backlash."""

    tag: int


class AnyChain(NamedTuple):
    """Any machine, by the recursive form."""

    tag: int


class _Type(NamedTuple):
    """Type of a tag, as numba passes it to the function that chooses an implementation."""

    instance_class: type


def uncompiled(choose: Callable[..., Any], kind: Any, *arguments: Any) -> Any:
    """Runs in Python the implementation that numba would compile for a tag.

    Used with NUMBA_DISABLE_JIT=1, to step through a run or to find a fault without the compiler.
    """
    return choose(_Type(type(kind)), *arguments)(kind, *arguments)


def entry(function: Callable[..., Any]) -> Any:
    """Compiles a function that Python calls. It is cached on disk and releases Python's lock."""
    return compiled(function, nogil=True)
