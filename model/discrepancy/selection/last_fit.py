"""Updates steps to the values of the last fit: a step's own values are biased by effects that were found after it.

The sentences of an answer are made afterwards, so that they give the size of the last fit too. The pattern of a reason,
and its errors, stay those of the step.
"""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.candidates.candidate_fit import Fit, judge
from model.discrepancy.candidates.estimates import found_values, shift_by_noise
from model.discrepancy.diagnosis import FoundValue, Step
from model.discrepancy.grounds import Refusal
from model.discrepancy.output_error.search import Point, converge, point_at
from model.discrepancy.selection.step import LAST_STEPS
from model.machine_model.parameter import Parameter


def update_to_last_fit(current: Fit, steps: Sequence[Step]) -> tuple[Fit, tuple[Step, ...]]:
    """The last fit, and steps with its parameters.

    An effect whose intervals contain the values at which it is absent is dropped: a later one explains what it did, and
    the last fit is made without it.
    """
    adopted = [s for s in steps if s.adopted]
    if not adopted:
        return current, tuple(steps)
    values = _values(current, adopted)
    known = current.point.model.by_name
    empty = [s for s in adopted[:-1] if _is_nothing([(values[n], known[n]) for n in s.parameters])]
    if empty:
        current = _without(current.point, [name for s in empty for name in s.parameters])
        values = _values(current, [s for s in adopted if s not in empty])

    def updated(step: Step) -> Step:
        if not step.adopted:
            return step
        if step in empty:
            return step.model_copy(update={"adopted": False, "refusal": Refusal(kind="superfluous")})
        return step.model_copy(update={"parameters": {n: values[n] for n in step.parameters}})

    return current, tuple(updated(s) for s in steps)


def _values(now: Fit, steps: Sequence[Step]) -> dict[str, FoundValue]:
    """Parameters of steps, with intervals that include how far noise has shifted the estimates."""
    own = [now.point.model.by_name[name] for s in steps for name in s.parameters]
    return found_values(now, own, shift_by_noise(now.point, own))


def _without(point: Point, gone: Sequence[str]) -> Fit:
    """The fit without the effects that have these parameters."""
    model, known = point.fitted_model, point.model.by_name
    for effect, joints in dict.fromkeys((known[n].effect, known[n].joints) for n in gone):
        model = model.without_effect(effect or "", joints or None)
    kept = [k for k, u in enumerate(point.unknowns) if u.name not in gone]
    begun = point_at(point.observation, point.only(kept).of(model), point.tangents[kept])
    return judge(converge(begun, LAST_STEPS))


def _is_nothing(found: Sequence[tuple[FoundValue, Parameter]]) -> bool:
    """Whether the values at which an effect is absent lie in its intervals, as far as bounds allow."""
    sizes = [(value, p.null, max(p.null, p.low)) for value, p in found if p.null is not None]
    return all(
        v.low is not None and v.high is not None and v.low <= nearest and null <= v.high for v, null, nearest in sizes
    )
