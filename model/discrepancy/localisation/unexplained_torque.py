"""What none of the known effects explains, as a torque at a joint: when, and against what.

A joint responds to a torque with a deviation of its reading, which its loop brings back. The impulse response is taken
from the model itself, at a moment of the record in which the joint slides. The torque that would leave the residual is
then found by deconvolution, as smooth as the noise of the residual allows. A joint that friction holds shows no torque,
so that the result means little there. Torques at one joint that move another are neglected.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.linalg import solveh_banded

from daq.contracts.machine import NoController
from model.arrays import Floats
from model.discrepancy.diagnosis import RemainingShape
from model.discrepancy.localisation.dependence import AGAINST, dependence, quantities
from model.discrepancy.localisation.disagreement import optional
from model.discrepancy.localisation.residuals import Residuals
from model.dynamics.recursive import mass_matrix
from model.fitting.records import Record
from model.machine_model.parameter import initial_velocity
from model.simulation.chain_of_model import chain_of
from model.simulation.period import OUT_READING, OUT_SPEED
from model.simulation.prepared import Options
from model.simulation.simulate import sensitivities, simulate

MEMORY = 40
"""Length of the impulse response, control periods."""
ROUGHEST, SMOOTHEST = 1e-6, 1e6
"""Bounds of the weight of smoothness, relative to that of the data."""
TRIALS = 16
"""Bisections between them."""
LEAST_MEAN_SQUARE = 1.1
"""Mean square of the weighted residual below which there is nothing to explain."""
LEAST_EXPLAINED = 0.05
"""Least share of the torque's variance that a dependence must explain to be reported."""
LEAST_SIGNIFICANCE = 4.0
"""Least significance, in standard deviations, of a dependence that is reported."""


def remaining_shapes(residuals: Residuals) -> tuple[RemainingShape, ...]:
    """The remaining torque in bins of time, position, speed, direction and drive; the dependence that explains most
    comes first.

    Empty where no joint is off by more than noise, or where what is left depends on none of these.

    Raises SpecError when a simulation does not stay finite.
    """
    machine = residuals.model.machine
    known = quantities(residuals.motions)
    found = []
    for j, joint in enumerate(machine.modelled_joints):
        if np.mean(np.square(residuals.of_joint(j))) < LEAST_MEAN_SQUARE * residuals.deviations[j] ** 2:
            continue
        torque = np.concatenate(_torques(residuals, j))
        size = float(np.sqrt(np.mean(torque**2)))
        for against in AGAINST:
            bins = dependence(torque, j, against, known, 1e-3 * size) if size > 0 else None
            if bins is None or bins.significance < LEAST_SIGNIFICANCE or bins.explained < LEAST_EXPLAINED:
                continue
            found.append(
                RemainingShape(
                    joint=joint,
                    against=against,
                    unit=known.units[against][j],
                    torque_unit="N·m" if machine.joint(joint).kind == "revolute" else "N",
                    centres=tuple(map(float, bins.centres)),
                    torque=optional(bins.mean),
                    deviation=optional(bins.deviation),
                    explained=bins.explained,
                )
            )
    return tuple(sorted(found, key=lambda s: -s.explained))


def torque_of(residuals: Residuals) -> list[Floats]:
    """Torque (m, n) per record, N·m or N, that would cause the residual, joint by joint."""
    columns = [_torques(residuals, j) for j in range(residuals.model.joint_count)]
    return [np.stack(own, axis=1) for own in zip(*columns, strict=True)]


def _torques(residuals: Residuals, j: int) -> list[Floats]:
    """The same of one joint, (m,) per record; zero outside the stretches that are compared."""
    found = []
    for record, residual in zip(residuals.records, residuals.signals, strict=True):
        response = _impulse_response(residuals, record, j)
        torque = np.zeros(len(residual))
        for run in record.runs:
            torque[run] = _deconvolved(residual[run, j], response, float(residuals.deviations[j]))
        found.append(torque)
    return found


def _impulse_response(residuals: Residuals, record: Record, j: int) -> Floats:
    """Readings (MEMORY,) after 1 N·m (N) at joint j for one period: exact derivatives by the speeds at the start.

    An impulse p at joint j changes all speeds by D⁻¹ e_j p.
    """
    model, share = residuals.model, residuals.feedback_share
    loop: Literal["open", "closed"] = "open" if isinstance(model.machine.controller, NoController) else "closed"
    run = simulate(model, record.inputs, Options(loop=loop, quantise=False, following=share))
    begin = _sliding(run.velocity[:, j])
    part = slice(begin, begin + MEMORY)
    inputs = replace(
        record.inputs,
        time=record.inputs.time[part],
        set_points=record.inputs.set_points[part],
        drive=record.inputs.drive[part],
        readings=record.inputs.readings[part],
        initial=np.stack([run.position[begin], run.velocity[begin]], axis=1),
        first_drive=run.drive[max(begin - 1, 0)].copy(),
        rows=np.arange(float(len(run.time[part]))),
        noise=record.inputs.noise[part],
    )
    speeds_at_start = [initial_velocity(joint) for joint in model.machine.modelled_joints]
    slopes = sensitivities(model, inputs, speeds_at_start, Options(loop=loop, following=share)).of(
        OUT_SPEED if residuals.quantity == "velocity" else OUT_READING
    )
    speeds = np.linalg.inv(mass_matrix(chain_of(model), run.position[begin]))[:, j]
    impulse = np.einsum("i,ik->k", speeds, slopes[:, :, j])
    held = 0.5 * (impulse + np.concatenate([[0.0], impulse[:-1]]))
    held[0] = 0.0
    return np.asarray(record.inputs.period * held)


def _sliding(speed: Floats) -> int:
    """Period at which the joint begins to slide for `MEMORY` periods, at the highest speed that it keeps up so long."""
    count = len(speed) - MEMORY
    if count <= 0:
        return 0
    slowest = np.lib.stride_tricks.sliding_window_view(np.abs(speed), MEMORY).min(axis=1)
    return int(slowest[: count + 1].argmax())


def _deconvolved(residual: Floats, response: Floats, deviation: float) -> Floats:
    """The smoothest torque (k,) whose response leaves no more of the residual (k,) than noise."""
    scale = float(response @ response)
    if scale == 0.0 or len(residual) < 2:
        return np.zeros(len(residual))
    low, high = np.log(ROUGHEST * scale), np.log(SMOOTHEST * scale)
    torque = np.zeros(len(residual))
    for _ in range(TRIALS):
        middle = 0.5 * (low + high)
        torque = _smoothed(residual, response, float(np.exp(middle)))
        left = residual - np.convolve(torque, response)[: len(residual)]
        if np.mean(left**2) > deviation**2:
            high = middle
        else:
            low = middle
    return torque


def _smoothed(residual: Floats, response: Floats, weight: float) -> Floats:
    """Least squares of residual − response ∗ torque with `weight` times the squared differences of neighbours."""
    count, reach = len(residual), min(len(response), len(residual))
    bands = np.zeros((reach, count))
    for lag in range(reach):
        bands[lag, : count - lag] = response[lag:reach] @ response[: reach - lag]
    bands[0] += weight * np.concatenate([[1.0], np.full(count - 2, 2.0), [1.0]]) + 1e-9 * bands[0, 0]
    bands[1, : count - 1] -= weight
    right = np.convolve(residual[::-1], response)[:count][::-1]
    return np.asarray(solveh_banded(bands, right, lower=True))
