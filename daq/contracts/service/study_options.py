"""Options of a study, as its request gives them, for the functions that compute it."""

from __future__ import annotations

from typing import TypeVar

from pydantic import BaseModel

from daq.contracts.service.jobs import DiagnoseStudy, FitStudy

Chosen = TypeVar("Chosen", bound=BaseModel)


def options_of(study: FitStudy | DiagnoseStudy, kind: type[Chosen]) -> Chosen:
    """Returns the options of a study. Options that are not given get the method's defaults."""
    given = {name: getattr(study, name, None) for name in kind.model_fields}
    return kind(**{name: value for name, value in given.items() if value is not None})
