"""The effect that is suspected where none can be named, and how much longer a record would have to be."""

from __future__ import annotations

import numpy as np

from model.discrepancy.diagnosis import Suspicion
from model.discrepancy.inverse_dynamics.comparison import compare
from model.discrepancy.inverse_dynamics.judging import (
    CHANCES,
    SUSPECTED,
    needed_evidence,
)
from model.discrepancy.inverse_dynamics.search import Findings
from model.discrepancy.inverse_dynamics.standing import Standing

SUSPECTED_SHARE = 0.05
"""Least share by which a suspected effect must make the mean square smaller on records not fitted to. Two thousandths
of the viscous friction, as Coulomb friction, took 1 to 3 % of what was left of a sound axis."""
ROUNDED = 5.0
"""s to which the time that is still to be recorded is rounded up."""


def suspect(standing: Standing, found: Findings) -> Suspicion | None:
    """The best candidate that was not named for want of evidence alone; None where there is none.

    What speaks for it grows in proportion to the time recorded, and its cost hardly does.
    """
    case = standing.case
    for chosen in found.fitted[:CHANCES]:
        if chosen.evidence <= 0:
            continue
        total = chosen.evidence + chosen.told
        needed = needed_evidence(standing, chosen)
        if not SUSPECTED <= total < needed:
            continue
        comparison = compare(standing, chosen)
        if comparison is None or comparison.removed < max(SUSPECTED_SHARE, case.options.least_share):
            continue
        recorded = sum(float(np.ptp(r.time)) for r in (*case.records, *case.held_out))
        seconds = recorded * ((needed + chosen.cost) / (total + chosen.cost) - 1)
        return Suspicion(
            effect=chosen.effect,
            joints=chosen.joints,
            evidence=total,
            needed=needed,
            seconds=ROUNDED * float(np.ceil(seconds / ROUNDED)),
        )
    return None
