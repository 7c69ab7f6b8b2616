"""One effect on several joints: found on all of them at once, and not where only one has it."""

from dataclasses import replace
from functools import cache

import pytest

from daq.contracts.progress import Never
from model.discrepancy.candidates.candidate_fit import CandidateFit, Fit, fit_several_joints, judge, nearest, refit
from model.discrepancy.candidates.library import hypotheses
from model.discrepancy.candidates.probing import Probe, probe
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import converge, point_at
from model.discrepancy.thresholds import THRESHOLDS
from tests.model.fitting import imagined

LOSS = 0.2


@cache
def before(joints: tuple[int, ...]) -> tuple[Fit, tuple[Probe, ...]]:
    """A record of an arm whose gears lose so much on these joints, its tolerance fit, and gear loss probed there."""
    arm = imagined.arm().with_effect("gear_loss", joints, {"loss": LOSS})
    given = point_at(*observe(imagined.arm(), [imagined.trace(arm, seconds=8.0)]))
    fitted = judge(converge(given, 4))
    probes = probe(fitted.point, hypotheses(fitted.point.model, ("gear_loss",), (1, 2, 3)))
    return fitted, tuple(probes)


@cache
def fits(joints: tuple[int, ...]) -> tuple[tuple[CandidateFit, ...], tuple[CandidateFit, ...]]:
    """Of gear loss on every joint alone, and on several."""
    fitted, probes = before(joints)
    singles = [r for r in (refit(fitted, p) for p in probes) if r is not None]
    return tuple(singles), tuple(fit_several_joints(fitted, singles, probes, THRESHOLDS, Never()))


def test_an_effect_on_three_joints_is_found_on_all_of_them() -> None:
    singles, several = fits((1, 2, 3))
    best = max(several, key=lambda r: r.evidence)
    assert best.hypothesis.joints == (1, 2, 3)
    assert best.evidence > max(r.evidence for r in singles) + THRESHOLDS.significant
    for joint in (1, 2, 3):
        found = best.fit.point.value(f"joint{joint}.gear_loss.loss")
        assert abs(found - LOSS) < 0.25 * LOSS


def test_an_effect_on_one_joint_is_found_on_no_other() -> None:
    singles, several = fits((2,))
    assert max(singles, key=lambda r: r.evidence).hypothesis.joints == (2,)
    assert several == ()


@pytest.mark.slow
def test_an_effect_on_two_joints_is_not_found_on_the_third() -> None:
    _, several = fits((1, 3))
    assert max(several, key=lambda r: r.evidence).hypothesis.joints == (1, 3)


def test_a_fit_begins_from_the_start_that_explains_more() -> None:
    fitted, probes = before((2,))
    right = next(p for p in probes if p.hypothesis.joints == (2,))
    wrong = replace(right, start=dict.fromkeys(right.start, 0.9))
    assert nearest(fitted.point, [wrong, right]) is right
    assert nearest(fitted.point, [right, wrong]) is right
