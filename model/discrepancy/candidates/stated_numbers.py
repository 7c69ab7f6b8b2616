"""Numbers of the machine that a fit has moved far from what its file states, as effects that do the same.

A link that is heavier than stated is fitted as a mass within its tolerance, however far off, as long as the prior costs
less than what the record gains. An effect with a number of its own does the same for nothing: the one is what is named.
"""

from __future__ import annotations

import numpy as np

from model.discrepancy.candidates.library import Hypothesis
from model.discrepancy.candidates.probing import Probe
from model.discrepancy.output_error.search import STRAINED, Point

_NUMBERS = {
    "link_mass": ("mass",),
    "payload": ("mass",),
    "input_delay": ("delay",),
    "weakened_magnet": ("torque_constant", "back_emf_constant"),
}
"""By effect, the parts of a machine's numbers that it changes."""


def as_effect(point: Point, hypothesis: Hypothesis) -> Probe | None:
    """A start of a hypothesis that has all of the distance of a number far from its expectation, while that number is
    as expected; None where the hypothesis changes no such number.

    The gain is what the priors cost at the point.
    """
    parts = _NUMBERS.get(hypothesis.name)
    main = hypothesis.main
    if parts is None or len(main) != 1:
        return None
    own = [
        k
        for k, u in enumerate(point.unknowns)
        if u.parameter.part in parts and u.parameter.effect is None and _is_of(u.joints, hypothesis)
    ]
    away = (point.values - point.expected) * np.sqrt(point.precision)
    far = [k for k in own if abs(away[k]) >= STRAINED]
    if not far:
        return None
    most = max(far, key=lambda k: abs(away[k]))
    distance = float(point.values[most] - point.expected[most])
    if hypothesis.name == "weakened_magnet":
        distance /= -float(point.expected[most])
    parameter = main[0]
    size = float(np.clip((parameter.null or 0.0) + distance, parameter.low, parameter.high))
    moved = np.zeros_like(point.values)
    moved[own] = (point.expected - point.values)[own]
    return Probe(
        hypothesis, float(np.sum(away[own] ** 2)), {parameter.name: size}, moved, np.zeros_like(point.weighted)
    )


def _is_of(joints: tuple[int, ...], hypothesis: Hypothesis) -> bool:
    """Whether a number is of the hypothesis's joints; a controller's delay is of every joint."""
    return joints == hypothesis.joints or (hypothesis.name == "input_delay" and not joints)
