"""One effect on several joints: found on all of them at once, and not where only one has it."""

from __future__ import annotations

from functools import cache

import numpy as np

from daq.contracts.progress import Never
from model.discrepancy.candidates import candidates
from model.discrepancy.observation import observed
from model.discrepancy.probing import probed
from model.discrepancy.refitting import Refitted, judge, refitted
from model.discrepancy.search import point_at, settled
from model.discrepancy.thresholds import THRESHOLDS
from model.discrepancy.together import fitted_together
from tests.model.fitting import imagined

LOSS = 0.2


@cache
def fits(joints: tuple[int, ...]) -> tuple[tuple[Refitted, ...], tuple[Refitted, ...]]:
    """Of gear loss on every joint alone, and on several: of an arm whose gears lose so much on these joints."""
    arm = imagined.arm().with_effect("gear_loss", joints, {"loss": LOSS})
    observation, model, unknowns = observed(imagined.arm(), [imagined.trace(arm, seconds=8.0)])
    given = point_at(observation, model, unknowns, np.array([u.start for u in unknowns]), observation.quiet)
    before = judge(observation, settled(observation, given, 4))
    probes = probed(observation, before.point, candidates(before.point.model, ("gear_loss",), (1, 2, 3)))
    singles = [r for r in (refitted(observation, before, p) for p in probes) if r is not None]
    return tuple(singles), tuple(fitted_together(observation, before, singles, probes, THRESHOLDS, Never()))


def test_what_several_joints_have_is_found_on_all_of_them() -> None:
    singles, several = fits((1, 2, 3))
    best = max(several, key=lambda r: r.evidence)
    assert best.candidate.joints == (1, 2, 3)
    assert best.evidence > max(r.evidence for r in singles) + THRESHOLDS.significant
    for joint in (1, 2, 3):
        found = best.judged.point.value(f"joint{joint}.gear_loss.loss")
        assert abs(found - LOSS) < 0.25 * LOSS


def test_what_one_joint_has_is_found_on_no_other() -> None:
    singles, several = fits((2,))
    assert max(singles, key=lambda r: r.evidence).candidate.joints == (2,)
    assert several == ()


def test_what_two_joints_have_is_not_found_on_the_third() -> None:
    _, several = fits((1, 3))
    assert max(several, key=lambda r: r.evidence).candidate.joints == (1, 3)
