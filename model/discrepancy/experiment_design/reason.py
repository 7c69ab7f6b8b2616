"""Why an experiment is asked for, in one sentence: what it does, and where the candidates would differ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.localisation.phases import CREEP, HOLD, RAMP_START, REVERSAL, STEADY_RAMP, phases_of
from model.discrepancy.output_error.observation import Observation
from model.machine_model.model import Model

Floats = NDArray[np.float64]

WHILE = {
    RAMP_START: "at the start of ramps",
    STEADY_RAMP: "in steady motion",
    REVERSAL: "after reversals",
    CREEP: "while it creeps",
    HOLD: "at rest",
}


def separating(
    description: str, one: str, other: str, separation: float, model: Model, observation: Observation, left: Floats,
    joints: Sequence[int],
) -> str:  # fmt: skip
    """The sentence for rivals. left: (N,) the difference that no parameter could hide, in deviations of a reading."""
    joint, phase, share = _most(model, observation, left)
    place = f"joint {joint} {WHILE[phase]}" if tuple(joints) != (joint,) else f"{WHILE[phase]}"
    return (
        f"{description}: {one} and {other} would differ by {separation:.1f} standard deviations, the other parameters "
        f"refitted, {100 * share:.0f} % of it {'on ' if place.startswith('joint') else ''}{place}"
    )


def most_informative(description: str, nats: float) -> str:
    """The sentence where there are no rivals."""
    return (
        f"{description}: excites what these traces do not, and would tell {nats:.0f} nats more of the arm's parameters"
    )


def _most(model: Model, observation: Observation, left: Floats) -> tuple[int, int, float]:
    """Joint and phase that hold most of the squared difference, and their share."""
    record = observation.records[0]
    phases = np.concatenate([phases_of(model, record)[run] for run in record.runs])
    energy = left.reshape(phases.shape) ** 2
    total = max(float(energy.sum()), 1e-300)
    sums = {
        (joint, phase): float(energy[phases[:, column] == phase, column].sum())
        for column, joint in enumerate(model.machine.modelled_joints)
        for phase in WHILE
    }
    (joint, phase), most = max(sums.items(), key=lambda item: item[1])
    return joint, phase, most / total
