"""What a record shows of an effect, as data: the clearest pattern without it, and how far the error falls with it."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from model.discrepancy.diagnosis import Candidate, FoundValue
from model.discrepancy.explanation.patterns import is_off, patterns_of
from model.discrepancy.explanation.samples import Left, Motions, Samples, motions
from model.discrepancy.grounds import ErrorFall, NamedEffect, Pattern, Reason
from model.discrepancy.localisation.dependence import drive_units
from model.discrepancy.localisation.disagreement import spoken_unit
from model.discrepancy.numbers import ReadingUnits
from model.fitting.records import Record, Signal, resolution
from model.machine_model.model import Model

CLEAR = 0.1
"""Share of a residual from which a pattern is preferred to those after it in an effect's list."""
LEAST_COUNTS = 0.1
"""Counts of a joint's sensor; a smaller deviation is not written as a number."""


def reason(
    effect: str,
    joints: Sequence[int],
    parameters: Mapping[str, FoundValue],
    *,
    model: Model,
    before: Model,
    records: Sequence[Record],
    signal: Signal = "position",
    rival: Candidate | None = None,
    left: Left | None = None,
) -> Reason:
    """What speaks for an effect: the pattern that a record shows without it, and how far the error falls with it.

    The pattern is that of measured − simulated where the simulation has everything but the effect: the numbers of the
    fitted model, with the effect taken out again. So neither the other parameters nor the effect hide it.

    Args:
        parameters: of the effect, by full name.
        model: fitted, with the effect. before: the model without it; a parameter that it has already, such as the
            viscous friction of a machine file, goes back to its value there.
        rival: the next best that would be another answer.
        left: measured − simulated of a model, where the caller simulates better than without noise: an arm without
            noise sticks where the real one creeps, so that stiction or a dead zone would hardly show.

    Raises SpecError when a simulation does not stay finite.
    """
    found = motions(model, without_effect(model, before, effect, joints, parameters), records, signal, left)
    machine, modelled = model.machine, model.machine.modelled_joints
    own = list(joints) or [modelled[_most_affected(found)]]
    joint = max(own, key=lambda j: _gone(found.joint(modelled.index(j))))
    samples = found.joint(modelled.index(joint))
    return Reason(
        joint=joint,
        pattern=clearest_pattern(effect, samples, parameters, joint),
        units=_units(machine, joint),
        rms=_fall(samples, *spoken_unit(machine, joint)),
        rival=None if rival is None else NamedEffect(effect=rival.effect, joints=rival.joints, evidence=rival.evidence),
    )


def clearest_pattern(
    effect: str, samples: Samples, parameters: Mapping[str, FoundValue], joint: int | None = None
) -> Pattern:
    """The first of an effect's patterns that is clear in a record; if none is, the clearest."""
    found = patterns_of(effect, samples, by_part(parameters.values(), joint))
    if not found:
        return is_off(samples)
    return next((p for p in found if p.share > CLEAR), max(found, key=lambda p: p.share))


def without_effect(
    model: Model, before: Model, effect: str, joints: Sequence[int], parameters: Mapping[str, FoundValue]
) -> Model:
    """A fitted model with one effect taken out again, everything else as it was fitted."""
    had = {p.name for p in before.parameters}
    back = {n: before.parameter(n).value for n in parameters if n in had and n in model.by_name}
    result = model.with_values(back)
    if back and set(parameters) <= had:
        return result
    try:
        return result.without_effect(effect, tuple(joints) or None)
    except SpecError:
        return result


def by_part(found: Collection[FoundValue], joint: int | None) -> dict[str, float]:
    """Values by the part of the effect that they are; those of one joint where several have them."""
    own = [v for v in found if joint is None or joint in v.joints]
    return {v.part: v.value for v in own or found}


def _gone(samples: Samples) -> float:
    """Sum of squares that the effect takes off, as a multiple of the mean square that is left."""
    left = max(float(np.mean(samples.left**2)), 1e-300)
    return float(np.sum(samples.without**2 - samples.left**2)) / left


def _most_affected(found: Motions) -> int:
    count = found.columns["without"].shape[1]
    return max(range(count), key=lambda j: _gone(found.joint(j)))


def _fall(samples: Samples, factor: float, unit: str) -> ErrorFall:
    before, after = (factor * float(np.sqrt(np.mean(r**2))) for r in (samples.without, samples.left))
    return ErrorFall(before=before, after=after, unit=unit)


def _units(machine: Machine, number: int) -> ReadingUnits:
    joint = machine.joint(number)
    turns, velocity = joint.kind == "revolute", joint.sensor is not None and joint.sensor.measures == "velocity"
    place = "°" if turns else "mm"
    return ReadingUnits(
        factor=math.degrees(1.0) if turns else 1e3,
        unit=f"{place}/s" if velocity else place,
        place_unit=place,
        drive_unit=drive_units(machine)[machine.modelled_joints.index(number)],
        torque_unit="N·m" if turns else "N",
        least=0.0 if joint.sensor is None or velocity else LEAST_COUNTS * resolution(joint.sensor),
        turns=turns,
    )
