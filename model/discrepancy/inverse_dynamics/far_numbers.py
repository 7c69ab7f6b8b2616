"""Numbers of the machine that a fit has moved farther from its file than a file is taken to be off."""

from __future__ import annotations

from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.discrepancy.inverse_dynamics.priors import prior_distance
from model.discrepancy.inverse_dynamics.search import Fitted
from model.machine_model.record_verdict import FAR_OFF

NEARLY_ALL = 0.9
"""Share of an effect's evidence from priors, above which stated numbers imitate it."""


def far_numbers(now: BalanceFit) -> frozenset[str]:
    """Names of the machine's own numbers that a fit has `FAR_OFF` or more of their stated deviations from the file.

    Friction and other effects that a file states are none of them: files state these roughly (`resolution.is_far`).
    """
    own = [u for u in now.unknowns if u.parameter.effect is None and u.parameter.deviation and not u.nuisance]
    stated = [u.as_stated for u in own if u.deviation is not None]
    return frozenset(u.name for u in stated if abs(prior_distance(u, now.values[u.name])[0]) >= FAR_OFF)


def stands_for_far_number(before: BalanceFit, chosen: Fitted) -> bool:
    """Whether stated numbers imitate a candidate, and one of them is `FAR_OFF` deviations off without it and not with
    it, or is what it names.

    k ln n is what a parameter costs of which every sample tells a little more (Schwarz 1978). The size of an effect
    that stated numbers can imitate is known as well as these are stated, however long the record is.

    Args:
        before: the fit without the candidate.
    """
    fell = chosen.evidence + chosen.cost
    return chosen.relief > NEARLY_ALL and fell >= FAR_OFF**2 and bool(far_numbers(before) - far_numbers(chosen.fit))
