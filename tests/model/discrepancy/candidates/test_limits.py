"""Backlash without a gap is a gear that gives, and no rival of it."""

from dataclasses import replace

import numpy as np
import pytest

from model.discrepancy.candidates.candidate_fit import CandidateFit, Fit, judge, with_evidence
from model.discrepancy.candidates.library import law_on
from model.discrepancy.candidates.limits import without_limits
from model.discrepancy.candidates.probing import Probe
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import point_at
from model.fitting.unknowns import Unknown
from tests.model.fitting import imagined

COMPLIANCE = 0.004
"""rad/(N·m)"""


@pytest.fixture(scope="module")
def current() -> Fit:
    """The sound model on a record of an arm whose third gear gives."""
    arm = imagined.arm().with_effect("joint_compliance", (3,), {"compliance": COMPLIANCE})
    return judge(point_at(*observe(imagined.arm(), [imagined.trace(arm, seconds=2.0)])))


def backlash(current: Fit, gap: float) -> CandidateFit:
    """A fit that has ended with a gap (rad) and with contacts that give as the gear does."""
    before = current.point
    hypothesis = law_on(before.model, "backlash", (3,))
    assert hypothesis is not None
    values = {"gap": gap, "contact": COMPLIANCE, "damping": 1.0}
    own = [Unknown(p, values[p.part], p.low, p.high) for p in hypothesis.free]
    begun = replace(before.only(range(len(before.unknowns))), model=hypothesis.model)
    begun = replace(begun, unknowns=(*before.unknowns, *own), values=np.append(before.values, [u.start for u in own]))
    probe = Probe(hypothesis, 1.0, {}, np.zeros_like(before.values), np.zeros_like(before.weighted))
    return with_evidence(current, probe, point_at(before.observation, begun))


def test_backlash_without_a_gap_becomes_the_gear_that_gives(current: Fit) -> None:
    (kept,) = without_limits(current, [backlash(current, 0.0)])
    assert (kept.hypothesis.name, kept.hypothesis.joints) == ("joint_compliance", (3,))
    found = {p.part: kept.fit.point.value(p.name) for p in kept.hypothesis.free}
    assert found["compliance"] == pytest.approx(COMPLIANCE, rel=0.2)


def test_backlash_with_a_gap_stays(current: Fit) -> None:
    found = backlash(current, 0.01)
    assert without_limits(current, [found]) == [found]
