"""Trials that the records tell: a limit shows only below the largest drive, however much the supply could give, and a
cable on one side only where the joint passes the place at which it becomes taut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.discrepancy.candidates.library import TAUT_QUANTILES, TAUT_WITHIN, Hypothesis
from model.discrepancy.output_error.observation import Observation

SHARES = (0.85, 0.65, 0.45)
"""Shares of the largest recorded drive at which a limit is tried, where the usual trials are all beyond it."""


def with_recorded_trials(hypothesis: Hypothesis, observation: Observation) -> Hypothesis:
    """The hypothesis; of a supply limit whose trials the record never reaches, with trials that it does reach; of a
    spring on one side, with rests among the recorded positions."""
    if hypothesis.name == "one_sided_spring":
        return _taut_within(hypothesis, observation)
    if hypothesis.name != "supply_limit" or not all(r.inputs.has_drive for r in observation.records):
        return hypothesis
    column = observation.machine.modelled_joints.index(hypothesis.joints[0])
    largest = max(float(np.abs(r.inputs.drive[:, column]).max()) for r in observation.records)
    (limit,) = hypothesis.main
    if largest <= 0.0 or any(trial[limit.name] < largest for trial in hypothesis.trials):
        return hypothesis
    trials = tuple({limit.name: share * largest} for share in SHARES if share * largest > limit.low)
    return replace(hypothesis, trials=(*hypothesis.trials, *trials))


def _taut_within(hypothesis: Hypothesis, observation: Observation) -> Hypothesis:
    """The hypothesis with its rest among the recorded positions of its joint, rad (m)."""
    rests = [p.name for p in hypothesis.free if p.part == "rest"]
    if not rests:
        return hypothesis
    column = observation.machine.modelled_joints.index(hypothesis.joints[0])
    positions = np.concatenate([r.inputs.readings[:, column] for r in observation.records])
    low, high = (float(x) for x in np.nanquantile(positions, TAUT_WITHIN))
    tried = (float(x) for x in np.nanquantile(positions, TAUT_QUANTILES))
    trials = tuple({**trial, **dict.fromkeys(rests, rest)} for rest in tried for trial in hypothesis.trials)
    return replace(hypothesis, trials=trials, bounds={**hypothesis.bounds, **dict.fromkeys(rests, (low, high))})
