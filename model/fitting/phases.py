"""Phases of torques that repeat over time: every record begins at one of its own.

An arm that stays on does not know when a record begins. Sine and cosine of a disturbance are those of the first record;
in every further one, they are turned by a phase that belongs to that record alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Kind, Parameter

SIZE = 0.5
"""Natural size of a change of a phase, rad."""


def phase_unknowns(model: Model, records: int, first: int = 1) -> tuple[Unknown, ...]:
    """Returns the phase, rad, of every disturbance of a model in every record from `first` on: 1 where sine and cosine
    are fitted to the same records, 0 where they are of others."""
    return tuple(
        Unknown(_phase(sine, record), 0.0, nuisance=True, trace=record, size=SIZE)
        for sine, _ in model.disturbances
        for record in range(first, records)
    )


def is_phase(unknown: Unknown) -> bool:
    """Whether an unknown is the phase of a disturbance in one record."""
    return unknown.trace is not None and unknown.parameter.effect is not None


def turned_pairs(model: Model, values: Mapping[str, float], record: int) -> list[tuple[Parameter, float]]:
    """Returns the sines and cosines of a record's disturbances that `values` turn, with their values there."""
    found: list[tuple[Parameter, float]] = []
    for pair in model.disturbances:
        angle = values.get(_phase(pair[0], record).name, 0.0)
        if angle:
            sine, cosine = (values.get(p.name, p.value) for p in pair)
            turned = (
                sine * math.cos(angle) - cosine * math.sin(angle),
                sine * math.sin(angle) + cosine * math.cos(angle),
            )
            found += zip(pair, turned, strict=True)
    return found


def turned_direction(
    model: Model, values: Mapping[str, float], record: int, parameter: Parameter
) -> dict[int, float] | None:
    """Returns how the slots of a record's disturbance change with its sine, its cosine or its phase in that record.

    None for other parameters, and where the record has no phase among `values`.
    """
    for sine, cosine in model.disturbances:
        phase = _phase(sine, record).name
        if phase not in values or parameter.name not in (sine.name, cosine.name, phase):
            continue
        turn = np.exp(1j * values[phase])
        pair = values.get(sine.name, sine.value) + 1j * values.get(cosine.name, cosine.value)
        change = turn * (1j * pair if parameter.name == phase else 1.0 if parameter.name == sine.name else 1j)
        return {**dict.fromkeys(sine.slots, change.real), **dict.fromkeys(cosine.slots, change.imag)}
    return None


def phases_of(signals: Sequence[Floats], times: Sequence[Floats], rate: float) -> list[float]:
    """Returns the phase of a tone in each signal (m,) relative to the first, rad. times: (m,) s. rate: rad/s."""
    tones = [np.exp(-1j * rate * t) @ (x - x.mean()) if x.size else 0j for x, t in zip(signals, times, strict=True)]
    return [float(np.angle(tone * np.conj(tones[0]))) for tone in tones]


def phase_part(record: int) -> str:
    """Returns which number of a disturbance its phase in a record (index) is."""
    return f"phase in trace {record + 1}"


def _phase(sine: Parameter, record: int) -> Parameter:
    return Parameter(
        name=f"trace{record + 1}.joint{'+'.join(map(str, sine.joints))}.{sine.effect}.phase",
        kind=Kind.EFFECT,
        part=phase_part(record),
        unit="rad",
        value=0.0,
        effect=sine.effect,
        joints=sine.joints,
    )
