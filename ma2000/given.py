"""What programs give in place of a model: a machine, or its name."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from model.machine_model.model import Model, base_model

ModelLike = Model | Machine | str
"""A model, a machine, or the name or file of a machine."""


def model_of(given: ModelLike) -> Model:
    """The model; of a machine that of its file. Raises SpecError for anything else."""
    if isinstance(given, Model):
        return given
    if isinstance(given, Machine | str | Path):
        return base_model(given if isinstance(given, Machine) else str(given))
    raise SpecError(f"model: give a Model, a Machine, or the name or file of a machine, not {type(given).__name__}")
