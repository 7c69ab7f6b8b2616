"""Joints on which an effect that was found on several has only a slight share.

A law that is not quite the arm's leaves something on other joints, which the same effect, a little of it, explains.
"""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.diagnosis import Step
from model.machine_model.model import Model

SLIGHT_EVIDENCE = 0.05
"""Share of an effect's evidence on all joints that must be missing without a joint."""
SLIGHT_SIZE = 0.2
"""Size on a joint, in its expected deviations, as a share of the largest on any. An effect that a joint does have may
hardly show on a record, but is not small as well."""


def with_slight_joints(steps: Sequence[Step], before: Model, after: Model) -> tuple[Step, ...]:
    """The steps, each with the joints on which its effect is slight: both little evidence and a small size.

    Args:
        before: the model as given; what it states of an effect does not count as its size. after: with the effects.
    """
    adopted = [s for s in steps if s.adopted and s.effect is not None and s.joints and s.proof is None]
    slight: dict[int, tuple[int, ...]] = {}
    for effect in dict.fromkeys(s.effect for s in adopted):
        alike = [s for s in adopted if s.effect == effect]
        sizes: dict[int, float] = {}
        for step in alike:
            sizes |= _sizes(step, before, after)
        evidence = sum(s.evidence for s in alike)
        for step in alike:
            small = [j for j in step.joints if sizes.get(j, 0.0) < SLIGHT_SIZE * max(sizes.values(), default=0.0)]
            slight[id(step)] = tuple(j for j in small if _brought(step, j) < SLIGHT_EVIDENCE * evidence)
    return tuple(s.model_copy(update={"slight_joints": slight[id(s)]}) if slight.get(id(s)) else s for s in steps)


def _sizes(step: Step, before: Model, after: Model) -> dict[int, float]:
    """By joint: the effect's distance from what the model as given has of it, in expected deviations."""
    found: dict[int, float] = {}
    for name, value in step.parameters.items():
        p = after.by_name.get(name)
        if p is None or p.null is None or not p.deviation:
            continue
        known = before.by_name.get(name)
        size = abs(value.value - (p.null if known is None else known.value)) / p.deviation
        for joint in value.joints:
            found[joint] = max(found.get(joint, 0.0), size)
    return found


def _brought(step: Step, joint: int) -> float:
    """Evidence that a joint adds to that of the others; all of the step's where no fit without it is known."""
    others = set(step.joints) - {joint}
    fitted = [c for c in step.candidates if c.effect == step.effect and c.refitted]
    return step.evidence - max((c.evidence for c in fitted if c.joints and set(c.joints) <= others), default=0.0)
