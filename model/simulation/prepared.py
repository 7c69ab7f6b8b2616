"""Options of a simulation, and a record in the units that compiled code reads."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import BoardPid, NoController, SampledPid, of_joint
from model import layout as at
from model.arrays import Floats
from model.machine_model.model import Model
from model.machine_model.nominal import is_rod_arm
from model.simulation.inputs import RunInputs

POSTURE_UNITS = 1000
"""Number of posture units over the range of a sensor, as the board counts them."""
NEARLY_WHOLE = 1e-3
"""Distance of a set point from a whole count, in counts, that rounding in the record explains."""
NO_ACCIDENT = 20
"""Number of different set points of one joint above which whole counts cannot be a coincidence."""
LONGEST_STEP = 1e-3
"""Longest integration step, s. Readings are then accurate to about 0.005 counts, except in contacts
(docs/modelling.md).
"""


@dataclass(frozen=True)
class Options:
    """How to simulate.

    Args:
        loop: `closed`: the model's controller follows the recorded set points; `open`: the recorded drive is applied.
        quantise: round readings and power as the board does. If False, neither is rounded.
        step: longest integration step, s.
        noise: (k, n) added to the readings before rounding, in counts of the sensor; None for none.
        following: the simulated controller reads a value between the simulated (0) and the recorded reading (1). 0: an
            output error in closed loop. 1: the controller reads the record with its noise; the recorded motion thus
            drives the model, and no feedback corrects its error.
        recorded_drive: in closed loop, the recorded drive is the input. The controller, without rounding, limits or a
            wrong gain, adds its output for 1 − `following` of the distance between recorded and simulated reading.
            Where a sample is missing the controller computes the drive.
        initial: (n, 2) position (rad) and speed (rad/s) at the start; None: as estimated from the record.
        general: use the recursive dynamics even where there is a closed form.
    """

    loop: Literal["closed", "open"] = "closed"
    quantise: bool = True
    step: float = LONGEST_STEP
    noise: Floats | None = None
    following: float = 0.0
    recorded_drive: bool = False
    initial: Floats | None = None
    general: bool = False


@dataclass(frozen=True)
class Prepared:
    """One record in the units that compiled code reads (`RecordArrays`)."""

    set_points: Floats
    recorded: Floats
    noise: Floats
    readings: Floats
    following: float
    initial: Floats
    first_drive: Floats
    gains: Floats
    settings: NDArray[np.int64]
    period: float

    def with_setting(self, setting: int, value: int) -> Prepared:
        """Returns the record with one of its integer settings changed (`model.layout`)."""
        settings = self.settings.copy()
        settings[setting] = value
        return replace(self, settings=settings)


def prepare(model: Model, inputs: RunInputs, options: Options) -> Prepared:
    """Converts the inputs of a run to the form that compiled code reads.

    Raises TraceError if the record lacks the input of this loop, SpecError for other joints or noise of another shape.
    """
    machine = model.machine
    if inputs.joints != machine.modelled_joints:
        raise SpecError(
            f"the inputs are for joints {inputs.joints}, but the model moves joints {machine.modelled_joints}"
        )
    settings = np.zeros(at.SETTINGS, dtype=np.int64)
    controller = machine.controller
    if options.loop == "closed" and not isinstance(controller, NoController) and not inputs.has_set_points:
        raise TraceError(f"trace {inputs.name}: has no set points; simulate it in open loop from its drive")
    if options.loop == "open" and not inputs.has_drive:
        raise TraceError(f"trace {inputs.name}: has no drive, which a simulation in open loop needs")
    settings[at.QUANTISE] = int(options.quantise)
    settings[at.PUBLISHED_LOADS] = int(is_rod_arm(machine))
    set_points = inputs.set_points
    if options.loop == "closed" and isinstance(controller, BoardPid):
        settings[at.CONTROLLER] = at.BOARD_PID
        set_points = _counts(model, set_points)
    elif options.loop == "closed" and isinstance(controller, SampledPid):
        settings[at.CONTROLLER] = at.SAMPLED_PID if controller.velocity_gains is None else at.CASCADE
        set_points = _rounded(controller, machine.modelled_joints, set_points)
    elif options.loop == "closed" and not isinstance(controller, NoController):
        raise SpecError(f"controller {controller.kind!r} cannot be simulated")
    if options.recorded_drive and settings[at.CONTROLLER] != at.NO_CONTROLLER:
        if not inputs.has_drive:
            raise TraceError(f"trace {inputs.name}: has no drive, which `recorded_drive` needs as input")
        settings[at.DRIVE_RECORDED] = 1
    noise = inputs.noise if options.noise is None else np.ascontiguousarray(options.noise)
    initial = inputs.initial if options.initial is None else np.ascontiguousarray(options.initial)
    if noise.shape != set_points.shape:
        raise SpecError(f"noise has shape {noise.shape}; it must be {set_points.shape}")
    return Prepared(
        set_points=set_points,
        recorded=inputs.drive,
        noise=noise,
        readings=inputs.readings,
        following=options.following,
        initial=initial,
        first_drive=inputs.first_drive,
        gains=inputs.gains,
        settings=settings,
        period=inputs.period,
    )


def _rounded(controller: SampledPid, joints: tuple[int, ...], set_points: Floats) -> Floats:
    """Returns set points as a sampled controller reads them."""
    found = set_points.copy()
    for column, joint in enumerate(joints):
        resolution = of_joint(controller.set_point_resolution, joint)
        if resolution is not None:
            found[:, column] = resolution.value * np.floor(found[:, column] / resolution.value + 0.5)
    return found


def _whole_counts(model: Model, set_points: Floats) -> Floats | None:
    """Returns set points in ADC counts if all are whole and a joint has too many for a coincidence, else None."""
    counts = np.empty_like(set_points)
    for k, joint in enumerate(model.machine.modelled_joints):
        if model.machine.joint(joint).sensor is None:
            return None
        own = model.machine.calibration(joint)
        counts[:, k] = (set_points[:, k] - own.angle_at_zero_rad) / own.rad_per_count
    whole = np.round(counts)
    if np.abs(counts - whole).max() > NEARLY_WHOLE:
        return None
    return whole if max(len(np.unique(column)) for column in whole.T) >= NO_ACCIDENT else None


def _counts(model: Model, set_points: Floats) -> Floats:
    """Returns set points in ADC counts as the board uses them: rounded to posture units, then to counts (half up).

    Set points that are already whole counts are kept: the board then receives no posture units.
    """
    own_counts = _whole_counts(model, set_points)
    if own_counts is not None:
        return own_counts
    counts = np.empty_like(set_points)
    for k, joint in enumerate(model.machine.modelled_joints):
        own = model.machine.calibration(joint)
        posture = np.floor((set_points[:, k] - own.angle_at_zero_rad) / own.rad_per_posture_unit + 0.5)
        counts[:, k] = np.floor(posture * own.counts / POSTURE_UNITS + 0.5)
    return counts
