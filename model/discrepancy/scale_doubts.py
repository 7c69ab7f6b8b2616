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

OUT_OF_SCALE = 30.0
"""Ratio between the torque that a drive gives by the machine file and that which the motion needs, above which the
drive is taken to be of another unit. Friction that no file states comes to a few times what bodies need."""


def on_scale(model: Model, records: Sequence[RecordedMotion]) -> tuple[Note, ...]:
    """A warning about joints whose drive does not suit their motion; none where all do.

    Args:
        model: as given.
    """
    if not records:
        return ()
    given = np.concatenate(TorqueBalance(model, tuple(records)).supplied_by_drive())
    needed = np.concatenate(TorqueBalance(model, tuple(map(_undriven, records))).residual({}))
    joints = []
    for column, joint in enumerate(model.machine.modelled_joints):
        gives, needs = (_root_mean_square(torque[:, column]) for torque in (given, needed))
        silent = not any(record.commanded[:, column].any() for record in records)
        ratio = 0.0 if silent else gives / needs if needs > 0.0 else 1.0
        if not 1 / OUT_OF_SCALE < ratio < OUT_OF_SCALE:
            joints.append({"joint": joint, "ratio": ratio, "unit": model.machine.joint(joint).drive_units[0]})
    return (Note(kind="drive-out-of-scale", values={"joints": joints}, warning=True),) if joints else ()


def _undriven(record: RecordedMotion) -> RecordedMotion:
    """The same motion without a drive: the balance then leaves all that the motion needs, whatever limit a drive of
    another unit would be cut off at."""
    return replace(record, drive=np.zeros_like(record.drive), commanded=np.zeros_like(record.commanded))


def _root_mean_square(signal: Floats) -> float:
    return float(np.sqrt(np.mean(signal**2)))
