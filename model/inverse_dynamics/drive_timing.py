"""How long after its sample a recorded drive acts, where no file tells: a number of the record's, of every joint.

A controller holds a drive until its next sample, so the drive acts half a sample late on average; the computation
before it and a current loop behind it take more. No record shows which of these was at work, so lateness up to two
samples is fitted as a nuisance beside the tolerances (decision 0053), and is no effect.
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
"""The effect that is named beyond that; on its joint it takes the place of the nuisance."""


def timing_unknowns(model: Model) -> tuple[Unknown, ...]:
    """The lateness of every joint's drive, but for joints whose delay the model has as an effect; none where the file
    describes a controller, whose period is known."""
    if holds_drive_between_samples(model.machine):
        return ()
    return tuple(
        Unknown(_lateness(joint), HELD, 0.0, MOST, HELD, DEVIATION, nuisance=True)
        for joint in model.machine.modelled_joints
        if joint not in _delayed(model)
    )


def expected_timing(model: Model) -> dict[str, float]:
    """What is expected of the lateness of every joint's drive, by name: no file states it, so that it is no error of a
    model as it was given."""
    return {unknown.name: unknown.expected for unknown in timing_unknowns(model)}


def samples_late(model: Model, values: Mapping[str, float]) -> Floats:
    """Lateness (n,) of the joints' drives in samples, as `values` have it by name; 0 where they do not name it, and on
    a joint whose delay the model has as an effect."""
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
