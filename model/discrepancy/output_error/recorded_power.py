"""Error and power of a board whose record holds set points, positions and the volts of its drive instead.

Where P alone acts, the power is in proportion to set point − position, to rounding. A factor between them that is the
same in the whole record is the gain; where there is none, set points were lost or the controller is another one, and
the record proves nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from daq.contracts.machine import BoardPid, DcMotor, Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.drives.controller import POWER_MAX

LEAST_AGREEMENT = 0.95
"""Least share of samples whose power must be the gain times the error, to rounding."""
LEAST_POWER = 4.0
"""Least power of a sample that is used for a gain, DAC counts: rounding dominates below it."""
ROUNDING = 1.0
"""DAC counts by which a power may differ: it is rounded once, from errors that are whole counts."""


def with_power(traces: Sequence[Trace], machine: Machine) -> tuple[Trace, ...]:
    """The traces with the errors and the power that their set points and volts tell; those that tell nothing as they
    are."""
    return tuple(_with_power(trace, machine) for trace in traces)


def _with_power(trace: Trace, machine: Machine) -> Trace:
    if trace.error is not None or trace.power_raw is not None or trace.set_point is None or trace.drive is None:
        return trace
    powers = np.zeros(trace.drive.shape, dtype=np.int64)
    for joint in machine.modelled_joints:
        column = trace.column(joint)
        found = _power(trace, machine, joint, column)
        if found is None:
            return trace
        powers[:, column] = np.round(found)
    return replace(trace, error=trace.set_point - trace.position, power_raw=powers)


def _power(trace: Trace, machine: Machine, joint: int, column: int) -> Floats | None:
    """Power (k,) of a joint, DAC counts; None where it is not a gain times the error."""
    controller, own = machine.controller, machine.joint(joint)
    if not isinstance(controller, BoardPid) or not isinstance(own.drive, DcMotor) or own.sensor is None:
        return None
    gains = (trace.record.gains or {}).get(joint, controller.gains[joint - 1])
    if any(gains[1:]) or trace.set_point is None or trace.drive is None:
        return None
    unit = own.sensor.direction * own.sensor.range.value / 2**own.sensor.bits
    error = np.round((trace.set_point - trace.position)[:, column] / unit)
    wanted = gains[0] * controller.dac_counts_per_adc_count.value * error
    power = trace.drive[:, column] / (machine.drive_sign(joint) * own.drive.scale.counts_to_volts(1.0))
    used = (np.abs(wanted) > LEAST_POWER) & (np.abs(power) < POWER_MAX - 1)
    if not used.any():
        return None
    factor = float(np.median(power[used] / wanted[used]))
    limited = np.abs(power) >= POWER_MAX - 1
    agreed = limited | (np.abs(power - factor * wanted) <= ROUNDING)
    return np.asarray(power) if np.mean(agreed) >= LEAST_AGREEMENT else None
