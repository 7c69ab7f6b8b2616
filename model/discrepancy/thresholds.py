"""The lines that a diagnosis draws. All were chosen on tuning arms, none of which is among those that report rates."""

from __future__ import annotations

from dataclasses import dataclass

from model.machine_model.record_verdict import MORE_THAN_NOISE

FEEDBACK_SHARE = 0.8
"""Share of the way from the simulated to the recorded reading that the simulated controller is given, where models are
fitted and compared (docs/decisions/0020). More finds less: the laws of an arm are never exactly a model's, and a torque
that is a little wrong adds up. With less, what noise has moved looks like a torque."""
LARGER_PART = 0.5
"""Share of a whole from which something is the larger part of it. What is less than that beside a rival, or what it
would need, does not catch up with it; of a residual it is no explanation."""
UNSURE_NOISE = 3.0
"""How many times the usual evidence an effect needs in torques, and the usual lead a name: a noise of torques is never
known as well as a likelihood takes it to be. What priors say has no noise in it, and counts so many times as much."""
MOST_ROUNDS = 20
"""Rounds of an iteration, at most: what has not settled by then does not settle."""
CHANCES = 3
"""Candidates of one ranking that records not fitted to may refuse before the search ends."""
WITHIN_NOISE = 3.0
"""Deviations of noise that may be noise alone. A pair of rivals that far apart moves the evidence by 9, more than the
margin of a name."""


@dataclass(frozen=True)
class Thresholds:
    """What it takes to say something.

    Args:
        significant: evidence from which an effect counts as found.
        margin: lead in evidence from which one name is given, instead of a group.
        unexplained: excess variance of a joint's error, relative to its noise floor, above which something outside the
            library is missing. unnamed: the same on the fitted traces while no effect has been added; it then also
            holds for the residual of the fits themselves. place: probability that some cell of a sound arm's map is
            called significant then.
        least_share: share of a joint's excess variance that effects must explain; with less they only resemble what is
            missing.
        grown: relative growth of the held-out excess variance at which a joint is said to have become worse; not 0,
            because stuck joints break loose by chance.
        close: lead in evidence below which rivals are fitted to their ends before they are compared.
        interesting: gain of a probe below which no candidate is worth a fit.
    """

    significant: float = 10.0
    margin: float = 4.0
    unexplained: float = MORE_THAN_NOISE
    unnamed: float = 0.12
    place: float = 0.001
    least_share: float = 0.8
    grown: float = 0.1
    close: float = 40.0
    interesting: float = 12.0


THRESHOLDS = Thresholds()
TORQUE_LEAD = UNSURE_NOISE * THRESHOLDS.margin
"""Lead in evidence from which one name is given in torques, and for which a further joint is taken into an effect."""
