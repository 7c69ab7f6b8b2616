"""What is answered once no further effect is found, and what an answer that only resembles the truth takes back."""

from __future__ import annotations

import math
from collections.abc import Sequence

from model.discrepancy.diagnosis import SignalError, Step, Verdict
from model.discrepancy.grounds import Refusal
from model.discrepancy.thresholds import Thresholds

SCATTER = 4.0
"""Standard deviations of a variance known from so many samples, within which it may be above its floor by chance."""


def unexplained(
    fitted: Sequence[SignalError], held: Sequence[SignalError], thresholds: Thresholds, *, named: bool,
    samples: tuple[int, int] = (10**9, 10**9),
) -> tuple[int, ...]:  # fmt: skip
    """Joints on which more is left than noise leaves, and than a law that is only nearly the arm's may leave.

    Args:
        fitted, held: errors before any effect was added, and now, on fitted and on held-out traces.
        named: whether effects have been added. samples: of a joint, on fitted and on held-out traces.
    """
    in_sample = thresholds.unexplained if named else thresholds.unnamed
    found = []
    for errors, line, count in ((fitted, in_sample, samples[0]), (held, thresholds.unexplained, samples[1])):
        least = max(line, SCATTER * math.sqrt(2.0 / max(count, 1)))
        for e in errors:
            before, after = ((size / e.floor) ** 2 - 1.0 for size in (e.before, e.after))
            if after > max(least, (1.0 - thresholds.least_share) * before if named else 0.0):
                found.append(e.joint)
    return tuple(dict.fromkeys(found))


def verdict(steps: Sequence[Step], left: Sequence[int]) -> Verdict:
    """The answer, from the steps and the joints that stay unexplained. A group that held-out traces have refused is
    none."""
    if left:
        return "unknown-effect"
    if any(s.adopted and s.group for s in steps):
        return "ambiguous"
    return "named" if any(s.adopted for s in steps) else "nothing-significant"


def first_to_withdraw(steps: Sequence[Step], left: Sequence[int]) -> int | None:
    """Index of the first step on a joint that stays unexplained: with it the search took a wrong way."""
    for k, step in enumerate(steps):
        if step.adopted and (not step.joints or set(step.joints) & set(left)):
            return k
    return None


def withdrawn(step: Step, left: Sequence[int]) -> Step:
    """The step, not taken into the model after all."""
    why = Refusal(kind="only-resembles", joints=tuple(left))
    return step.model_copy(update={"adopted": False, "refusal": why}) if step.adopted else step
