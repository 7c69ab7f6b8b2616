"""Fitted candidates of which only name, joints and evidence matter."""

from typing import Any, cast

import numpy as np

from model.discrepancy.candidates.candidate_fit import CandidateFit
from model.discrepancy.candidates.library import Hypothesis
from model.discrepancy.candidates.probing import Probe
from tests.model.fitting import imagined


def candidate_fit(name: str, joints: tuple[int, ...], evidence: float, price: float = 0.0) -> CandidateFit:
    """A candidate with that evidence, after its price, and without the fit that it would come from."""
    hypothesis = Hypothesis(name, joints, imagined.arm(), (), (), proportional=True)
    probe = Probe(hypothesis, 0.0, {}, np.zeros(0), np.zeros(0))
    return CandidateFit(probe, cast(Any, None), evidence, price)
