"""A load that a user states for the arm."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.contracts.carried_load import carrying

if TYPE_CHECKING:
    from model.machine_model.model import Model


def with_load(model: Model, kilograms: float) -> Model:
    """The model of the same machine with another load at its end. Raises SpecError as `carrying` does."""
    from model.machine_model.model import Model

    machine = carrying(model.machine, kilograms, "given with --load")
    values = {name: value for name, value in model.values.items() if name != "load.mass"}
    fields = {name: getattr(model, name) for name in type(model).model_fields}
    return Model(**{**fields, "machine": machine, "values": values})
