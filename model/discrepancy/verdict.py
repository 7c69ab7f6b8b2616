"""The verdict of a diagnosis, and the comparison of errors with their noise floor that it rests on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Literal, TypeVar

from daq.contracts.machine import Machine
from model.discrepancy.diagnosis import Gap, GapNumber, GapStage, GapWithout, SignalError, Step, Verdict
from model.discrepancy.grounds import Refusal
from model.discrepancy.thresholds import THRESHOLDS, Thresholds
from model.machine_model.model import base_model
from model.machine_model.record_verdict import SCATTER

LEAST_EXCESS = 0.25
"""Least relative excess variance for which a removed share is reported; a 17 s record resolves it to ±0.06."""


def verdict(steps: Sequence[Step], *, unexplained: bool, suspected: bool = False, partly: bool = False) -> Verdict:
    """The verdict of either method.

    Args:
        steps: all of them; only those that were adopted count. A group that held-out traces have refused is not one.
        unexplained: whether what is left speaks against the steps, or is there without any. By output error that is
            any joint above its line; by inverse dynamics, where no step was adopted, a shape in the remaining torque,
            or a torque that is slow and far above noise.
        suspected: whether an effect lacks nothing but evidence, and has some.
        partly: whether far more than noise is left beside the effects that were adopted.
    """
    if suspected and not any(s.adopted for s in steps):
        return "suspected"
    if unexplained:
        return "unknown-effect"
    if partly and any(s.adopted for s in steps):
        return "partly"
    if any(s.adopted and s.group for s in steps):
        return "ambiguous"
    return "named" if any(s.adopted for s in steps) else "nothing-significant"


def excess_variance(error: SignalError) -> tuple[float, float]:
    """Variance above the noise floor in units of the floor's, before and after."""
    before, after = ((size / error.floor) ** 2 - 1.0 for size in (error.before, error.after))
    return before, after


def excess_removed(errors: Sequence[SignalError]) -> float | None:
    """Share of the excess variance that is gone, summed over the joints with at least `LEAST_EXCESS` before.

    None where no joint has so much: a share of what may be noise means nothing.
    """
    shown = [(before, after) for before, after in map(excess_variance, errors) if before >= LEAST_EXCESS]
    return 1.0 - sum(after for _, after in shown) / sum(before for before, _ in shown) if shown else None


def worse_held_out(held: Sequence[SignalError]) -> tuple[int, ...]:
    """Joints whose error on held-out traces has grown beyond what noise may do."""
    grown = 1.0 + THRESHOLDS.grown
    return tuple(e.joint for e in held if (e.after / e.floor) ** 2 > grown * (e.before / e.floor) ** 2 + LEAST_EXCESS)


def unexplained(
    fitted: Sequence[SignalError],
    held: Sequence[SignalError],
    thresholds: Thresholds,
    *,
    named: bool,
    samples: tuple[int, int] = (10**9, 10**9),
) -> tuple[int, ...]:
    """Joints whose error stays above what noise leaves, and above what a nearly right law of the effect would leave.

    Args:
        fitted, held: errors before any effect was added and now, on fitted and on held-out traces.
        named: whether effects have been added. samples: per joint, on fitted and on held-out traces.
    """
    in_sample = thresholds.unexplained if named else thresholds.unnamed
    found = []
    for errors, line, count in ((fitted, in_sample, samples[0]), (held, thresholds.unexplained, samples[1])):
        least = max(line, SCATTER * math.sqrt(2.0 / max(count, 1)))
        for e in errors:
            before, after = excess_variance(e)
            if after > max(least, (1.0 - thresholds.least_share) * before if named else 0.0):
                found.append(e.joint)
    return tuple(dict.fromkeys(found))


def withdrawn(step: Step, unexplained_joints: Sequence[int]) -> Step:
    """The step, not taken into the model after all."""
    why = Refusal(kind="only-resembles", joints=tuple(unexplained_joints))
    return step.model_copy(update={"adopted": False, "refusal": why}) if step.adopted else step


MOST_NUMBERS = 5
"""Numbers of a file that are listed."""
Fitted = TypeVar("Fitted")
Errors = dict[str, tuple[float | None, ...]]
"""Root mean squares by joint, on traces `fitted` to and on `held_out` ones."""


def gap_of(
    measure: Literal["closed-loop", "torques"],
    joints: Sequence[tuple[int, str, float, float]],
    errors: Callable[[Fitted], Errors],
    given: Fitted,
    first: Fitted,
    taken: Sequence[tuple[Step, Fitted]],
    end: Fitted,
    numbers: tuple[GapNumber, ...],
) -> Gap:
    """The gap of a diagnosis.

    Args:
        joints: each with its unit, its noise and the most of it. errors: of a fit. given, first: before anything was
            fitted, and before any effect was added. taken: the adopted steps, each with the fit without those after it,
            its numbers within what the file states. end: the last fit. numbers: as `gap_numbers`, of `first`.
    """
    effects = (GapStage(kind="effect", effect=s.effect, joints=s.joints, **errors(after)) for s, after in taken)
    return Gap(
        measure=measure,
        joints=tuple(joint for joint, _, _, _ in joints),
        units=tuple(unit for _, unit, _, _ in joints),
        noise=tuple(noise for _, _, noise, _ in joints),
        most=tuple(most for _, _, _, most in joints),
        stages=(
            GapStage(kind="given", **errors(given)),
            *effects,
            GapStage(kind="refitted" if taken else "fitted", **errors(end)),
        ),
        without=GapWithout(**errors(first), numbers=numbers) if taken else None,
    )


def gap_numbers(machine: Machine, without: Mapping[str, float], fitted: Mapping[str, float]) -> tuple[GapNumber, ...]:
    """Numbers of a machine file that would have had to move by more than a stated deviation, the furthest first.

    Args:
        without, fitted: values by name, fitted without and with the effects.
    """
    found = [
        GapNumber(name=p.name, unit=p.unit, stated=p.value, deviation=p.deviation, without=value, fitted=fitted[p.name])
        for p in base_model(machine).parameters
        if p.deviation and p.name in fitted and (value := without.get(p.name)) is not None
    ]
    moved = [n for n in found if abs(n.without - n.stated) > n.deviation]
    return tuple(sorted(moved, key=lambda n: abs(n.without - n.stated) / n.deviation, reverse=True)[:MOST_NUMBERS])
