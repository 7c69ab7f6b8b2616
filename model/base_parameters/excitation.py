"""Determines which base parameters records determine: their columns along the recorded motion, weighted by the residual
torque."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats, Mask
from model.base_parameters.grouping import DEPENDENT, Grouping
from model.base_parameters.result import Excitation, RecordedBaseParameter
from model.base_parameters.standard import Motion, Standard, inertial_regressor, joint_regressor
from model.fitting.covariance import inverse, sandwich
from model.fitting.problem import Whitened, whitened_residual
from model.fitting.whitening import fitted_whitener
from model.inverse_dynamics.fit import CUTOFF, LONGEST_MEMORY
from model.inverse_dynamics.link_motion import link_motion
from model.inverse_dynamics.recorded_motion import RecordedMotion, recorded_motions
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model
from model.machine_model.nominal import joint_scale
from model.simulation.chain_of_model import chain_of

TOLD = 0.1
"""Largest deviation of a base parameter that counts as determined, as a share of its size. The size is the largest
value of its unit at its joint, so that a moment of zero can be determined to be zero."""
STANDS = 10.0
"""Counts of its sensor that a joint must move in a record for its torques to contain information on its friction."""
LEAST_LEFT = 1e-6
"""Least residual torque used as a weight of a record, as a share of its torque: a record without noise leaves almost
none."""


def excitation_of(
    model: Model, traces: Sequence[Trace], standards: Sequence[Standard], grouping: Grouping, values: Floats
) -> Excitation:
    """Returns the deviations with which records determine base parameters with these values (r,).

    They are those of least squares on torques, without a prior; they allow for the correlation of the residual, like
    those of a fit of torques.

    Raises:
        TraceError, SpecError: for traces without a drive, of another machine, without motion, or too short.
    """
    motions = recorded_motions(traces, model.machine, CUTOFF)
    balance = TorqueBalance(model, motions)
    # columns are joint torques, and so is the compared signal
    told = balance.told_per_torque({})
    torques = [one / told for one in balance.supplied_by_drive()]
    residuals = [
        left / told * _moving(model, record) for left, record in zip(balance.residual({}), motions, strict=True)
    ]
    columns = [_columns(model, one, standards, grouping) for one in motions]
    whole = np.concatenate([one.reshape(-1, one.shape[-1]) for one in columns])
    sizes = np.linalg.norm(whole, axis=0)
    singular = np.linalg.svd(whole[:, sizes > 0.0] / sizes[sizes > 0.0], compute_uv=False)
    rank = int(np.count_nonzero(singular > DEPENDENT * singular[0]))
    deviations = _deviations(residuals, torques, columns)
    left = np.concatenate(residuals)
    return Excitation(
        traces=tuple(trace.record.trace_id for trace in traces),
        samples=len(left),
        rank=rank,
        condition=float(singular[0] / singular[-1]) if rank == len(sizes) else None,
        residual=tuple(float(one) for one in np.sqrt((left**2).mean(axis=0))),
        parameters=tuple(
            _recorded(deviation, value, natural, excited=bool(size > 0.0))
            for deviation, value, natural, size in zip(
                deviations, values, _natural(standards, grouping, values), sizes, strict=True
            )
        ),
    )


def _natural(standards: Sequence[Standard], grouping: Grouping, values: Floats) -> Floats:
    """Returns sizes (r,) of base parameters: the largest value of the same unit at the same joint."""
    kinds = [(standards[index].joint, standards[index].unit) for index in grouping.base]
    return np.array([max(abs(v) for v, other in zip(values, kinds, strict=True) if other == own) for own in kinds])


def _recorded(deviation: float, value: float, natural: float, *, excited: bool) -> RecordedBaseParameter:
    if not excited or not np.isfinite(deviation):
        return RecordedBaseParameter(deviation=None, relative=None, told=False)
    relative = None if value == 0.0 else deviation / abs(value)
    return RecordedBaseParameter(
        deviation=float(deviation),
        relative=None if relative is None else float(relative),
        told=bool(deviation <= TOLD * natural),
    )


def _columns(model: Model, record: RecordedMotion, standards: Sequence[Standard], grouping: Grouping) -> Floats:
    """Returns columns (m, n, r) of the base parameters along a record, low-passed like the torques."""
    joints = np.ascontiguousarray(model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT))
    links = link_motion(record, joints)
    motion = Motion(links.position, links.speed, links.acceleration, links.contact)
    inertial = inertial_regressor(chain_of(model), motion)
    of_joints = joint_regressor(standards[inertial.shape[2] :], motion)
    whole = np.concatenate((inertial, of_joints), axis=2)[:, :, list(grouping.base)]
    # at rest, friction takes any torque that holds the joint: such samples contain no information
    return record.compared(whole) * _moving(model, record)[:, :, None]


def _moving(model: Model, record: RecordedMotion) -> Mask:
    """Returns (m, n) True where a joint moves; a joint that moves less than `STANDS` counts in all does not."""
    far = np.ptp(record.position, axis=0)
    counts = [joint_scale(model.machine, joint).resolution for joint in model.machine.modelled_joints]
    return np.asarray(record.moving & (far > STANDS * np.array(counts)))


def _deviations(residuals: Sequence[Floats], torques: Sequence[Floats], columns: Sequence[Floats]) -> Floats:
    """Returns standard deviations (r,) of the base parameters."""
    floor = LEAST_LEFT * np.sqrt(np.mean(np.concatenate(torques) ** 2, axis=0)) + 1e-12
    whiteners = [
        fitted_whitener([one[:, joint] for one in residuals], LONGEST_MEMORY, float(least))
        for joint, least in enumerate(floor)
    ]
    white = [whitened_residual(one, whiteners) for one in residuals]
    jacobians = [np.stack([w.whitened(one[:, joint]) for joint, w in enumerate(whiteners)], axis=1) for one in columns]
    starts = (0, *np.cumsum([len(one) for one in white]).tolist())
    flat = np.concatenate(jacobians)
    sizes = np.sqrt((flat**2).sum(axis=(0, 1)))
    shown = sizes > 0.0
    data = Whitened(np.concatenate(white), flat[:, :, shown] / sizes[shown], starts)
    least = np.full(int(shown.sum()), np.finfo(float).eps)
    robust = np.sqrt(np.diag(sandwich(data.information, data.scores(), least)))
    plain = np.sqrt(np.diag(inverse(data.information)))
    found = np.full(len(sizes), np.inf)
    found[shown] = np.maximum(robust, plain) / sizes[shown]
    return found
