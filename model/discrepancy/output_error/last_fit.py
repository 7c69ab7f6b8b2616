"""Steps as the last fit has them: what was still missing at their turn has bent their parameters.

The sentences of an answer are made afterwards, so that they give the size of the last fit too. The pattern of a reason,
and its errors, stay those of the step.
"""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.candidates.estimates import found_values, moved_by_noise
from model.discrepancy.diagnosis import FoundValue, Step
from model.discrepancy.grounds import Refusal
from model.discrepancy.output_error.case import with_point
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.refitting import Judged, judge
from model.discrepancy.output_error.search import Point, point_at, settled
from model.discrepancy.output_error.step import LAST_STEPS
from model.machine_model.parameter import Parameter


def as_last_fitted(
    observation: Observation, current: Judged, steps: Sequence[Step]
) -> tuple[Judged, tuple[Step, ...]]:  # fmt: skip
    """The last fit, and steps with its parameters. An effect that came out as nothing, within its intervals, is none: a
    later one explains what it did, and the last fit is made without it."""
    adopted = [s for s in steps if s.adopted]
    if not adopted:
        return current, tuple(steps)
    values = _values(observation, current, adopted)
    empty = [
        s for s in adopted[:-1] if _is_nothing([(values[n], current.point.model.by_name[n]) for n in s.parameters])
    ]
    if empty:
        current = _without(observation, current.point, [name for s in empty for name in s.parameters])
        values = _values(observation, current, [s for s in adopted if s not in empty])

    def told(step: Step) -> Step:
        if not step.adopted:
            return step
        if step in empty:
            return step.model_copy(update={"adopted": False, "refusal": Refusal(kind="superfluous")})
        return step.model_copy(update={"parameters": {n: values[n] for n in step.parameters}})

    return current, tuple(told(s) for s in steps)


def _values(observation: Observation, now: Judged, steps: Sequence[Step]) -> dict[str, FoundValue]:
    """Parameters of steps, with intervals that know what noise has done to the estimates."""
    own = [now.point.model.by_name[name] for s in steps for name in s.parameters]
    return found_values(observation, now, own, moved_by_noise(observation, now.point, own))


def _without(observation: Observation, point: Point, gone: Sequence[str]) -> Judged:
    """The fit without the effects that have these parameters."""
    model, known = with_point(point), point.model.by_name
    for effect, joints in dict.fromkeys((known[n].effect, known[n].joints) for n in gone):
        model = model.without_effect(effect or "", joints or None)
    kept = [k for k, u in enumerate(point.unknowns) if u.name not in gone]
    unknowns = [point.unknowns[k] for k in kept]
    begun = point_at(observation, model, unknowns, point.values[kept], point.tangents[kept])
    return judge(observation, settled(observation, begun, LAST_STEPS))


def _is_nothing(found: Sequence[tuple[FoundValue, Parameter]]) -> bool:
    """Whether the values at which an effect is absent lie in its intervals; bounds may keep an estimate from them."""
    sizes = [(value, p.null, max(p.null, p.low)) for value, p in found if p.null is not None]
    return all(
        v.low is not None and v.high is not None and v.low <= nearest and null <= v.high for v, null, nearest in sizes
    )
