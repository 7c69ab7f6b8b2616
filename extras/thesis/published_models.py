"""The models of chapter 7 as models of this library, with the published values or with those that a fit starts from."""

from __future__ import annotations

from daq.contracts.machine import Machine
from extras.thesis.tables import DATA_SHEET_BACK_EMF_2, SHARED_BACK_EMF, SYMBOLS, UNOPTIMISED, PublishedModel
from model.machine_model.model import Model, base_model

PARAMETER = {symbol.name: symbol.parameter for symbol in SYMBOLS}
"""Names of parameters in a model, by the symbols of the source."""
BACK_EMF_SYMBOLS = ("Kb1-3", "Kb2")
FRICTION_SYMBOLS = ("v_eff1", "v_eff2", "v_eff3", "μ̃")


def model_of(published: PublishedModel, machine: Machine, *, published_inertia: bool = True) -> Model:
    """A table of chapter 7 as a model of the machine. Raises SpecError for a machine that is not the MA2000's arm."""
    return _with_values(structure_of(published, machine, published_inertia=published_inertia), published.values)


def unfitted(published: PublishedModel, machine: Machine, *, published_inertia: bool = True) -> Model:
    """The same structure at the values from which the source starts: table 7.2, data-sheet K_b2, no friction."""
    values = {**UNOPTIMISED.values, "Kb2": DATA_SHEET_BACK_EMF_2, **dict.fromkeys(FRICTION_SYMBOLS, 0.0)}
    structure = structure_of(published, machine, published_inertia=published_inertia)
    return _with_values(structure, {s: v for s, v in values.items() if PARAMETER[s] in structure.by_name})


def structure_of(published: PublishedModel, machine: Machine, *, published_inertia: bool = True) -> Model:
    """Effects and ties of a table's model; values of the machine file."""
    model = base_model(machine, friction=False)
    model = model.tied(SHARED_BACK_EMF, ("joint1.motor.back_emf_constant", "joint3.motor.back_emf_constant"))
    if "v_eff1" in published.values:
        model = model.with_effect("viscous_friction", (1, 2, 3))
    if "μ̃" in published.values:
        model = model.with_effect("load_dependent_friction", (1, 2, 3), shared=True)
    return model.model_copy(update={"published_inertia": published_inertia})


def _with_values(model: Model, values: dict[str, float]) -> Model:
    complete = {"Kb2": DATA_SHEET_BACK_EMF_2, **values}
    return model.with_values({PARAMETER[symbol]: value for symbol, value in complete.items()})
