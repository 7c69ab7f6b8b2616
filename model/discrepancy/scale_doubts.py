"""Doubts whether a recorded drive is in the unit of its machine file: it gives far more, or less, than motion needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from model.arrays import Floats
from model.discrepancy.grounds import Note
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model

OUT_OF_SCALE = 100.0
"""Ratio between the torque that a drive gives by the machine file and that which the motion needs, or its inverse, from
which the drive is taken to be of another unit. mA for A, or mV for V, make it a thousand. On 784 records of rigs in
other worlds, whose files state friction, the drive gave 0.6 to 4.6 times what was needed."""


def on_scale(model: Model, records: Sequence[RecordedMotion]) -> tuple[Note, ...]:
    """A warning about joints whose drive does not suit their motion, where they move; none where all do.

    Args:
        model: as given. records: of its machine.
    """
    if not records:
        return ()
    given = np.concatenate(TorqueBalance(model, tuple(records)).supplied_by_drive())
    needed = np.concatenate(TorqueBalance(model, tuple(map(_undriven, records))).residual({}))
    joints = []
    moving = np.concatenate([record.moving for record in records])
    for column, joint in enumerate(model.machine.modelled_joints):
        rows = moving[:, column]
        gives, needs = (_root_mean_square(torque[rows, column]) for torque in (given, needed))
        if needs > 0.0 and not 1 / OUT_OF_SCALE < gives / needs < OUT_OF_SCALE:
            units = model.machine.joint(joint).drive_units
            unit = units[0] if len(units) == 1 else None
            joints.append({"joint": joint, "ratio": gives / needs, "unit": unit})
    return (Note(kind="drive-out-of-scale", values={"joints": joints}, warning=True),) if joints else ()


def _undriven(record: RecordedMotion) -> RecordedMotion:
    """The same motion without a drive: the balance then leaves all that the motion needs, whatever limit a drive of
    another unit would be cut off at."""
    drive, commanded = np.zeros_like(record.drive), np.zeros_like(record.commanded)
    return replace(record, drive=drive, commanded=commanded, at_limit=np.zeros_like(record.at_limit))


def _root_mean_square(signal: Floats) -> float:
    return float(np.sqrt(np.mean(signal**2))) if signal.size else 0.0
