"""A step of an answer in words: where it looked, what speaks for its effect, and why that was refused."""

from __future__ import annotations

import math

from daq.contracts.joint_text import slides
from daq.contracts.machine import Machine
from model.discrepancy.diagnosis import UNWRITTEN, FoundValue, Step, Where
from model.discrepancy.explanation.effect_words import PHASES, REFUSALS, plain, shape_of
from model.discrepancy.grounds import ControllerEffect, Refusal
from model.effects.names import capitalised, joints_in_words
from model.units import shown_unit, with_unit

NOISE_UNKNOWN = 1e6
"""Ratio of a residual to its noise, above which that noise is none: the machine file takes positions for exact, as one
made of a URDF does, and what rounding leaves is no measure."""
LEAST_SHOWN = 5e-4
"""Least share of a mean square that is not shown as 0.0 %."""


def sentence(words: str) -> str:
    """A clause as a sentence."""
    return f"{capitalised(words)}."


def where_with_summary(where: Where) -> Where:
    """The place with its summary."""
    if where.worst is None and where.summary != UNWRITTEN:
        return where
    return where.model_copy(update={"summary": sentence(_place(where))})


def _place(where: Where) -> str:
    """Where simulation and measurement disagree most, as a clause."""
    worst, largest = where.worst, where.largest
    if worst is None:
        return "no joint moves"
    phase = PHASES[worst.phase]
    if where.joint is None or worst.rms is None:
        return (
            f"no joint is off by more than noise; the largest residual is that of joint {worst.joint}, "
            f"{worst.ratio:.2f} times its noise {phase}"
        )
    times = f"{plain(worst.ratio)} times its noise"
    if worst.ratio >= NOISE_UNKNOWN:
        times = "and the machine file states no noise of the sensors to compare it with"
    seen = (
        f"joint {worst.joint}, {'mostly ' if worst.whole_record else ''}{phase}: {_rms(worst.rms, worst.unit)}, {times}"
    )
    if largest is None or largest.rms is None:
        return seen
    return f"{seen}; more is left of joint {largest.joint}, {_rms(largest.rms, largest.unit)}"


def _rms(value: float, unit: str) -> str:
    factor, shown = shown_unit(unit)
    return f"{with_unit(plain(value * factor, 3), shown)} rms"


def step_with_sentences(step: Step, machine: Machine) -> Step:
    """The step with its reason, its place, and why it was refused."""
    where = where_with_summary(step.where)
    if step.proof is not None:
        where = where.model_copy(update={"summary": sentence(_proof(step))})
    refused = step.rejected_because if step.refusal is None else refusal_words(step.refusal)
    return step.model_copy(update={"where": where, "reason": reason_text(step, machine), "rejected_because": refused})


def reason_text(step: Step, machine: Machine) -> str:
    """What speaks for the effect of a step, in a sentence, with the numbers of the step as it is now."""
    reason = step.reason_data
    if step.proof is not None:
        return sentence(f"{_proof(step)}; this needs no model of the arm")
    if reason is None:
        return step.reason
    sliding = all(slides(machine, j) for j in step.joints or machine.modelled_joints)
    place = f"{joints_in_words(step.joints)}: " if step.joints else ""
    sizes = (_size(v, several=len(step.joints) > 1, sliding=sliding) for v in step.parameters.values())
    seen = f"{place}{shape_of(step.effect or '', sliding=sliding)} ({', '.join(sizes)})"
    # Where it is told beyond noise, no second share stands beside it.
    taken = "" if reason.removed is None or step.excess_removed_holdout is not None else _removed(reason.removed)
    return sentence(f"{seen}{taken}")


def _proof(step: Step) -> str:
    """What the controller's own recorded numbers prove, as a clause."""
    assert step.proof is not None
    joint, samples, of = step.joints[0], step.proof.samples, step.proof.of
    if step.effect != ControllerEffect.WRONG_GAIN:
        lost = "the recorded error is not set point − position"
        return f"joint {joint}: {lost} in {samples} samples, so set points were lost"
    ratio = 1 + next(iter(step.parameters.values())).value
    power = f"the recorded power is {ratio:.3f} times the gain times the recorded error"
    return f"joint {joint}: {power} ({samples} of {of} samples)"


def _size(value: FoundValue, *, several: bool, sliding: bool) -> str:
    on = f" of {joints_in_words(value.joints)}" if several and value.joints else ""
    factor, unit = shown_unit(value.unit)
    text = plain(value.value * factor, 3)
    if value.part == "cycles":  # rad of phase per rad (m): cycles a turn, or 2π times those a metre
        text += f" rad/m, {plain(value.value / (2 * math.pi), 3)} a metre" if sliding else " a turn"
    elif unit != "1":
        text = with_unit(text, unit)
    return f"{value.part}{on} {text}"


def _removed(share: float) -> str:
    square = "the mean square error on records not fitted to"
    return f"; {square} grows by {-share:.0%}" if share < 0.0 else f"; it takes {percent_gone(share)} off {square}"


def refusal_words(refusal: Refusal) -> str:
    """Why an effect was not taken into the model, as a clause."""
    share, joints = refusal.numbers.get("share", 0.0), refusal.joints
    change = "does not fall"
    if abs(share) >= LEAST_SHOWN:
        change = f"falls by only {share:.1%}" if share > 0.0 else f"grows by {-share:.1%}"
    disagree = f"{joints_in_words(joints)} still disagree{'s' if len(joints) == 1 else ''}" if joints else ""
    return REFUSALS[refusal.kind].format(**refusal.numbers, change=change, disagree=disagree)


def removed_words(share: float) -> str:
    """The share of the held-out variance beyond noise that a step removed: all of it, where the error is below its
    floor. A clause."""
    if share < 0:
        return f"the held-out variance beyond noise has grown by {-100 * share:.1f} %"
    return f"{percent_gone(share)} of the held-out variance beyond noise is gone"


def percent_gone(share: float) -> str:
    """A share in percent; “all” for all of it. A share below all is never rounded up to 100 %."""
    if share >= 1.0:
        return "all"
    return f"{min(100 * share, 99.9):.1f} %".replace("-", "−")
