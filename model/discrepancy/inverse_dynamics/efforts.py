"""Recorded torques (forces) beside those that a model before and after a diagnosis predicts from the motion."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from daq.contracts.trace import Trace
from model.comparison.compare import TraceSignals
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.engine.fitting import fit
from model.discrepancy.inverse_dynamics.localisation import torque_unit
from model.discrepancy.inverse_dynamics.residual import TorqueResidual, samples_of
from model.inverse_dynamics.drive_timing import timing_unknowns
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.record_check.check import as_used
from model.record_check.pieces import in_pieces


def recorded_and_predicted(
    found: Diagnosis, traces: Sequence[Trace], held_out: Collection[str] = ()
) -> tuple[TraceSignals, ...]:
    """The effort of every trace below the cutoff of a diagnosis in torques: as the drive gave it by the machine file,
    and as the model before and after asks for it, which predict it from the recorded motion.

    Empty for a diagnosis by another method. How late drives act is fitted to every trace, as in the diagnosis. Where a
    joint rests, friction takes whatever torque holds it: the prediction is the record there.

    Args:
        held_out: identities of the traces that were not fitted to.

    Raises TraceError for traces that cannot be compared in torques.
    """
    cutoffs = [float(note.values["cutoff"]) for note in found.notes_data if note.kind == "cutoff"]
    if found.method != "inverse-dynamics" or not cutoffs:
        return ()
    whole = in_pieces(as_used(traces, found.model_before.machine))
    return tuple(_efforts(found, trace, cutoffs[0], trace.record.trace_id in held_out) for trace in whole)


def _efforts(found: Diagnosis, trace: Trace, cutoff: float, is_held_out: bool) -> TraceSignals:
    model = found.model_before
    records = recorded_motions([trace], model.machine, cutoff)
    recorded = TorqueBalance(model, records).supplied_by_drive()[0]
    floors = np.array([error.floor for error in found.rmse_fit])
    samples, floor = samples_of(records), np.maximum(floors, 1e-12)
    balances = [TorqueBalance(one, records) for one in (model, found.model_after)]
    compared = [TorqueResidual(balance, samples, floor, own_phases=True) for balance in balances]
    asked = [recorded + fit(one, timing_unknowns(one.model), {}).signals[0] for one in compared]
    moving = records[0].moving
    joints = model.machine.modelled_joints
    return TraceSignals(
        trace=trace.record.trace_id,
        held_out=is_held_out,
        joints=joints,
        units=tuple(torque_unit(model, j) for j in joints),
        time=records[0].time[records[0].rows],
        measured=recorded,
        simulated=tuple(np.where(moving, one, recorded) for one in asked),
        set_point=None,
        signal="effort",
    )
