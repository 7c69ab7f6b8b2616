"""Doubts about the gravity that a machine file states: its magnitude, and whether it points the other way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.grounds import Note
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import RecordedMotion, recorded_motions
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model

ON_EARTH = (9.76, 9.84)
"""Least and largest gravity on the ground, m/s²: on a mountain at the equator, and at a pole, rounded outwards."""
TURNED = 0.75
"""Least share of twice the torque of gravity that explains the residual, from which gravity counts as turned round. A
balance spring that carries the whole arm comes to 0.5."""
LEAST_REMOVED = 0.5
"""Least share of the residual's mean square that turning gravity round takes off."""
LEAST_TORQUE = 0.1
"""Least torque of gravity on any joint, as a share of the drive's, from which records tell its direction."""


def on_gravity(model: Model, traces: Sequence[Trace]) -> tuple[Note, ...]:
    """Warnings about the gravity of the model's machine file; none where it agrees with the traces.

    Its direction is judged where drives were recorded and the traces give accelerations.
    """
    if not traces:
        return on_gravity_along(model, ())
    try:
        records = recorded_motions(traces, model.machine, choose_cutoff(traces, model.machine))
    except (SpecError, TraceError):
        records = ()
    return on_gravity_along(model, records)


def on_gravity_along(model: Model, records: tuple[RecordedMotion, ...]) -> tuple[Note, ...]:
    """The same along motions whose torques are compared already."""
    magnitude = math.hypot(*model.machine.gravity)
    notes = []
    if magnitude != 0.0 and not ON_EARTH[0] <= magnitude <= ON_EARTH[1]:
        notes.append(Note(kind="gravity-magnitude", values={"magnitude": magnitude}, warning=True))
    if magnitude != 0.0 and records:
        notes += _on_direction(model, records)
    return tuple(notes)


def _on_direction(model: Model, records: tuple[RecordedMotion, ...]) -> list[Note]:
    balance, turned = TorqueBalance(model, records), TorqueBalance(_turned_round(model), records)
    supplied = np.sqrt(np.mean(np.concatenate(balance.supplied_by_drive()) ** 2, axis=0))
    if not (supplied > 0.0).all():
        return []
    left, left_turned = (np.concatenate(one.residual({})) / supplied for one in (balance, turned))
    change = left_turned - left
    twice_gravity = _mean_square(change)
    if not twice_gravity.max() > (2 * LEAST_TORQUE) ** 2:
        return []
    share = -float(np.sum(left * change) / np.sum(change**2))
    before, after = float(_mean_square(left).sum()), float(_mean_square(left_turned).sum())
    if not (share > TURNED and after < (1 - LEAST_REMOVED) * before):
        return []
    values = {"gravity": [g + 0.0 for g in model.machine.gravity], "removed": 1 - after / before}
    return [Note(kind="gravity-reversed", values=values, warning=True)]


def _mean_square(torque: Floats) -> Floats:
    """(n,) of torques (m, n)."""
    return np.asarray(np.mean(torque**2, axis=0))


def _turned_round(model: Model) -> Model:
    machine: Machine = model.machine.model_copy(update={"gravity": tuple(-g for g in model.machine.gravity)})
    fields = {name: getattr(model, name) for name in type(model).model_fields}
    return type(model)(**{**fields, "machine": machine})
