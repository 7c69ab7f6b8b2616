"""Lateness of a recorded drive: the time from its sample until it acts, a nuisance per joint.

A controller holds a drive until its next sample, so the drive acts half a sample late on average. Computation before it
and a current loop after it add to that. No record shows which of these was present. Lateness up to two samples is
therefore fitted as a nuisance beside the tolerances (decision 0053), and is no effect.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.recorded_motion import holds_drive_between_samples
from model.machine_model.model import Model
from model.machine_model.parameter import Kind, Parameter

HELD = 0.5
"""Expected lateness in samples of the record: that of a drive that is held until the next one."""
DEVIATION = 0.5
"""Its standard deviation, in samples: a measured torque is not late at all, a current loop adds half a sample."""
MOST = 2.0
"""Largest lateness that is no effect, in samples."""
DELAY = "input_delay"
"""The effect for larger lateness; on its joint it replaces the nuisance."""


def timing_unknowns(model: Model) -> tuple[Unknown, ...]:
    """Returns the lateness of every joint's drive, except joints with a delay effect in the model.

    Empty if the file describes a controller, whose period is known.
    """
    if holds_drive_between_samples(model.machine):
        return ()
    return tuple(
        Unknown(_lateness(joint), HELD, 0.0, MOST, HELD, DEVIATION, nuisance=True)
        for joint in model.machine.modelled_joints
        if joint not in _delayed(model)
    )


def expected_timing(model: Model) -> dict[str, float]:
    """Returns the expected lateness of every joint's drive, by name.

    No file states it, so it is no error of the given model.
    """
    return {unknown.name: unknown.expected for unknown in timing_unknowns(model)}


def samples_late(model: Model, values: Mapping[str, float]) -> Floats:
    """Returns the lateness (n,) of the joints' drives in samples, from `values` by name.

    0 if `values` lacks it, and for a joint with a delay effect in the model.
    """
    joints, delayed = model.machine.modelled_joints, _delayed(model)
    return np.array([0.0 if j in delayed else values.get(_lateness(j).name, 0.0) for j in joints])


def _delayed(model: Model) -> set[int]:
    return {joint for use in model.effects if use.name == DELAY for joint in use.joints}


def _lateness(joint: int) -> Parameter:
    return Parameter(
        name=f"joint{joint}.drive_timing.samples",
        kind=Kind.CONTROLLER,
        component="drive_timing",
        part="samples",
        unit="1",
        value=HELD,
        low=0.0,
        high=MOST,
        joints=(joint,),
    )
