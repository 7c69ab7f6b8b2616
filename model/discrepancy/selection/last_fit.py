"""Updates steps to the values of the last fit: a step's own values are biased by effects that were found after it.

The sentences of an answer are made afterwards, so that they give the size of the last fit too. The pattern of a reason,
and its errors, stay those of the step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
    the last fit is made without it. So is a joint of an effect on several, on which only its neighbours made it stand.
    """
    adopted = [s for s in steps if s.adopted]
    if not adopted:
        return current, tuple(steps)
    values = _values(current, adopted)
    known = current.point.model.by_name
    empty = [s for s in adopted[:-1] if _is_nothing([(values[n], known[n]) for n in s.parameters])]
    absent = {id(s): () if s in empty else _absent_on(s, values, known) for s in adopted}
    gone = [name for s in empty for name in s.parameters]
    gone += [name for s in adopted for name in s.parameters if set(known[name].joints) & set(absent[id(s)])]
    if gone:
        current = _without(current.point, gone)
        kept = [s.model_copy(update={"parameters": _kept(s, gone)}) for s in adopted if s not in empty]
        values = _values(current, kept)

    def updated(step: Step) -> Step:
        if not step.adopted:
            return step
        if step in empty:
            return step.model_copy(update={"adopted": False, "refusal": Refusal(kind="superfluous")})
        joints = tuple(j for j in step.joints if j not in absent[id(step)])
        return step.model_copy(update={"joints": joints, "parameters": {n: values[n] for n in _kept(step, gone)}})

    return current, tuple(updated(s) for s in steps)


def _kept(step: Step, gone: Sequence[str]) -> dict[str, FoundValue]:
    return {name: value for name, value in step.parameters.items() if name not in gone}


def _absent_on(step: Step, values: Mapping[str, FoundValue], known: Mapping[str, Parameter]) -> tuple[int, ...]:
    """Joints of an effect on several on which it may be absent; none where it may be absent on all."""
    own = {j: [(values[n], known[n]) for n in step.parameters if known[n].joints == (j,)] for j in step.joints}
    found = tuple(j for j, sizes in own.items() if sizes and _is_nothing(sizes))
    return found if len(found) < len(step.joints) else ()


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
