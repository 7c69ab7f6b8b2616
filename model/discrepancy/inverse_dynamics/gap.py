"""How the gap shrinks in the balance of torques: with the model as given, with each effect added, and refitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from model.discrepancy.diagnosis import Gap, GapStage, GapWithout, SignalError, Step
from model.discrepancy.explanation.fitted_numbers import gap_numbers
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, fit
from model.discrepancy.inverse_dynamics.holdout import held_out_squares
from model.discrepancy.inverse_dynamics.standing import Standing
from model.inverse_dynamics.drive_timing import expected_timing
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model

Numbers = tuple[float | None, ...]


def torque_gap(standing: Standing, first: BalanceFit, told: Sequence[SignalError]) -> Gap:
    """The gap of a diagnosis in torques.

    Args:
        first: the fit before any effect was added. told: errors of the joints of which records tell something.
    """
    case = standing.case
    columns = [standing.model.machine.modelled_joints.index(e.joint) for e in told]

    def errors(model: Model, values: Mapping[str, float]) -> dict[str, Numbers]:
        sets = {"fitted": case.records, "held_out": case.held_out}
        return {
            name: _roots(held_out_squares(model, values, records), columns) if records else ()
            for name, records in sets.items()
        }

    taken = [step for step in standing.steps if step.adopted]
    effects = []
    for number, step in enumerate(taken, start=1):
        found = _within_file(standing, taken[number:])
        own = errors(found.balance.model, found.values)
        effects.append(GapStage(kind="effect", effect=step.effect, joints=step.joints, **own))
    last = errors(standing.model, standing.now.values)
    numbers = gap_numbers(standing.model.machine, first.values, standing.now.values)
    return Gap(
        measure="torques",
        joints=tuple(e.joint for e in told),
        units=tuple(e.unit for e in told),
        noise=tuple(e.floor for e in told),
        stages=(
            GapStage(kind="given", **errors(standing.given, expected_timing(standing.given))),
            *effects,
            GapStage(kind="refitted" if taken else "fitted", **last),
        ),
        without=GapWithout(**errors(standing.given, first.values), numbers=numbers) if taken else None,
    )


def _within_file(standing: Standing, later: Sequence[Step]) -> BalanceFit:
    """The fit without the effects of later steps, with the numbers within one deviation of what the file states."""
    stated, model = standing.given.by_name, standing.model
    out: set[str] = set()
    for step in later:
        back = {name: stated[name].value for name in step.parameters if name in stated}
        out |= step.parameters.keys()
        model = model.with_values(back)
        joints = tuple(j for j in step.joints if not any(j in stated[name].joints for name in back))
        if step.effect is not None and (joints or not step.joints):
            model = model.without_effect(step.effect, joints or None)
    known = model.by_name.keys() - out  # a disturbance is named by size and phase, and fitted by sine and cosine
    unknowns = [u.within_stated for u in standing.now.unknowns if u.nuisance or u.name in known]
    balance = TorqueBalance(model, standing.case.records)
    return fit(balance, unknowns, standing.now.values, standing.case.data, standing.now.noise.memory)


def _roots(squares: np.ndarray, columns: Sequence[int]) -> Numbers:
    return tuple(float(np.sqrt(squares[c])) if np.isfinite(squares[c]) else None for c in columns)
