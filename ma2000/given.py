"""What programs give: arguments are checked by the types that functions state, before anything is computed."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

from numpy import ndarray

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from daq.contracts.trace import Traces, as_sequence
from model.machine_model.model import Model, base_model

ModelLike = Model | Machine | str
"""A model, a machine, or the name or file of a machine."""
_ALIKE: dict[type, Any] = {int: Integral, float: Real, str: str | PathLike, Path: str | PathLike, ndarray: object}
"""What may stand for a type: numbers of numpy, paths and their texts, all of which numpy makes an array."""
Function = TypeVar("Function", bound=Callable[..., Any])


def model_of(given: ModelLike) -> Model:
    """The model; of a machine that of its file. Raises SpecError for anything else."""
    if isinstance(given, Model):
        return given
    if isinstance(given, Machine | str | Path):
        return base_model(given if isinstance(given, Machine) else str(given))
    raise SpecError(f"model: give a Model, a Machine, or the name or file of a machine, not {type(given).__name__}")


def checked(function: Function, name: str) -> Function:
    """Returns the public function `ma2000.name`: a machine or its name stands for a model in every argument, and an
    argument of another type than stated is a one-line SpecError. Types that are known to checkers alone are left out.
    """
    signature = inspect.signature(function)
    hints = {
        one: hint for one, p in signature.parameters.items() if (hint := _hint(p.annotation, function)) is not None
    }

    @wraps(function)
    def asked(*given: Any, **named: Any) -> Any:
        bound = signature.bind(*given, **named)
        for one, value in bound.arguments.items():
            hint = hints.get(one)
            if hint in (Model, ModelLike):
                bound.arguments[one] = model_of(value)
            elif hint == Traces:
                as_sequence(value)
            elif hint not in (None, bool):  # consent, the flag that matters, has a check of its own
                check_argument(f"{name}: {one}", value, hint)
        return function(*bound.args, **bound.kwargs)

    asked.__module__, asked.__qualname__ = "ma2000", name  # pickle finds it by them
    return asked  # type: ignore[return-value]


def check_argument(what: str, value: object, hint: Any) -> None:
    """Raises a one-line SpecError for a value that is not of the type."""
    if not _suits(value, hint):
        raise SpecError(f"{what}: found {value!r:.80}, must be {_named(hint)}")


def _hint(annotation: Any, function: Callable[..., Any]) -> Any:
    """The type of an annotation; None for one whose names exist for type checkers alone."""
    if not isinstance(annotation, str):
        return None if annotation is inspect.Parameter.empty else annotation
    try:
        return eval(annotation, getattr(function, "__globals__", {}))
    except NameError:
        return None


def _suits(value: object, hint: Any) -> bool:
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return any(_suits(value, one) for one in parts)
    if origin is Literal:
        return value in parts
    kind = origin or hint
    if kind is Any or not isinstance(kind, type):
        return True
    if kind in _ALIKE:
        return isinstance(value, _ALIKE[kind])
    if parts and issubclass(tuple, kind):
        listed = isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping)
        return listed and (not isinstance(value, list | tuple) or all(_suits(one, parts[0]) for one in value))
    return isinstance(value, kind)


def _named(hint: Any) -> str:
    if get_origin(hint) in (Union, UnionType):
        return " or ".join(_named(one) for one in get_args(hint))
    if hint is NoneType:
        return "None"
    name = str(hint) if get_args(hint) else getattr(hint, "__name__", str(hint))
    return name.replace("typing.", "").replace("collections.abc.", "")
