"""Candidates that are far from where the search for the tolerance parameters has led."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.progress import Never
from model.arrays import Floats
from model.discrepancy.candidates.candidate_fit import (
    CandidateFit,
    Fit,
    diverged_from_prior,
    fit_several_joints,
    judge,
    nearest,
    polish,
    refit,
    restart,
    with_evidence,
)
from model.discrepancy.candidates.library import Hypothesis, hypotheses
from model.discrepancy.candidates.probing import Probe, probe
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.observation import Observation, observe
from model.discrepancy.output_error.search import converge, point_at
from model.discrepancy.thresholds import THRESHOLDS
from tests.model.fitting import imagined

DELAY = 0.015
"""s: the tolerance parameters go to the brink of instability to imitate so much."""


def counting(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One for every round of simulations."""
    rounds: list[int] = []
    readings = Observation.readings

    def counted(self: Observation, *arguments: Any, **named: Any) -> Any:
        rounds.append(1)
        return readings(self, *arguments, **named)

    monkeypatch.setattr(Observation, "readings", counted)
    return rounds


def test_a_fit_that_cannot_reach_its_goal_takes_few_simulations(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a cost to come to that it cannot reach, a fit takes few steps, and has no second way."""
    arm = imagined.arm().with_effect("dead_zone", (2,), {"width": 1.5})
    given = point_at(*observe(imagined.arm(), [imagined.trace(arm, seconds=8.0)]))
    before = judge(converge(given, 4))
    (found,) = probe(before.point, hypotheses(before.point.model, ("viscous_friction",), (2,)))
    counted = counting(monkeypatch)
    assert refit(before, found) is not None
    with_time, counted[:] = len(counted), []
    refit(before, found, goal=1.0, explained=True)
    assert 0 < len(counted) < 0.7 * with_time


def test_a_probe_that_lifts_a_prior_begins_near_where_its_fit_ends() -> None:
    """Not further off by what the prior had pulled the number back."""
    stated = imagined.arm().parameter("joint2.viscous_friction.coefficient")
    arm = imagined.arm().with_values({stated.name: stated.value + 8 * (stated.deviation or 0.0)})
    before = judge(converge(point_at(*observe(imagined.arm(), [imagined.trace(arm, seconds=8.0)])), 4))
    (found,) = probe(before.point, hypotheses(before.point.model, ("viscous_friction",), (2,)))
    end = refit(before, found)
    assert end is not None
    far = end.fit.point.value(stated.name) - stated.value
    assert abs(found.start[stated.name] - stated.value - far) < 0.15 * far


def test_a_point_has_diverged_where_unlikely_numbers_leave_the_record_unexplained() -> None:
    given = point_at(*observe(imagined.arm(), [imagined.trace(imagined.arm(), seconds=2.0)]))
    unknowns = given.unknowns
    sound = replace(given, weighted=given.weighted / np.sqrt(given.misfit))
    far = sound.values.copy()
    k = [u.name for u in unknowns].index("joint2.motor.rotor_inertia")
    far[k] += 10 * (unknowns[k].deviation or 0.0)
    unexplained = 3.0 * sound.weighted
    assert not diverged_from_prior(sound)
    assert not diverged_from_prior(replace(sound, weighted=unexplained))
    assert not diverged_from_prior(replace(sound, values=far))
    assert diverged_from_prior(replace(sound, weighted=unexplained, values=far))


def test_a_fit_with_unlikely_numbers_is_restarted() -> None:
    """An inductance that has been taken for a rotor's inertia, ten of its deviations off, with the record explained."""
    arm = imagined.arm().with_effect("motor_inductance", (2,), {"inductance": 0.06})
    before = judge(point_at(*observe(imagined.arm(), [imagined.trace(arm, seconds=8.0)])))
    (inductance,) = probe(before.point, hypotheses(before.point.model, ("motor_inductance",), (2,)))
    fitted = refit(before, inductance)
    assert fitted is not None
    assert restart(before, fitted) is fitted, "nothing is strange here"
    point = fitted.fit.point
    k = [u.name for u in point.unknowns].index("joint2.motor.rotor_inertia")
    strained = point.values.copy()
    strained[k] += 10 * (point.unknowns[k].deviation or 0.0)
    off = point.moved_to(strained)
    again = restart(before, with_evidence(before, inductance, off))
    assert again.fit.point.cost < off.cost - 50
    assert abs(again.fit.point.values[k] - point.values[k]) < 2 * (point.unknowns[k].deviation or 0.0)


def test_a_delay_that_led_the_tolerance_parameters_to_instability_is_fitted_from_the_expected_numbers() -> None:
    arm = imagined.arm().with_effect("input_delay", (3,), {"time": DELAY})
    given = point_at(*observe(imagined.arm(), [imagined.trace(arm, seconds=8.0)]))
    before = judge(converge(given, 4))
    (found,) = probe(before.point, hypotheses(before.point.model, ("input_delay",), (3,)))
    fitted = refit(before, found)
    assert fitted is not None
    assert fitted.fit.point.cost < 0.6 * before.point.cost
    assert fitted.fit.point.value("joint3.input_delay.time") > 0.7 * DELAY


@dataclass(frozen=True)
class Asked(Observation):
    """An observation that notes the names of the unknowns by which it is differentiated, and then gives up."""

    names: list[str] = field(default_factory=list)

    def tangents(self, tried: Calibration, which: Sequence[int] | None = None) -> Floats:
        self.names.extend(tried.unknowns[k].name for k in which or ())
        raise SpecError("the simulation does not stay finite: the control loop is unstable")


def test_a_polished_fit_gets_new_derivatives_by_all_numbers_that_act_on_its_joints() -> None:
    """A number that joint 2 shares with joint 1 is one of them, and so is one of the whole machine."""
    shared = imagined.arm().with_effect("dead_zone", (1, 2), {"width": 0.1}, shared=True)
    observation, given = observe(shared, [imagined.trace(shared, seconds=2.0)])
    point = point_at(observation, given, np.zeros((len(given.unknowns), observation.samples)))
    asked = Asked(observation.machine, observation.records, observation.deviations, observation.unit, ())
    hypothesis = Hypothesis("stiction", (2,), given.model, (), (), proportional=True)
    probed = Probe(hypothesis, 20.0, {}, np.zeros(len(given.values)), np.zeros_like(point.weighted))
    found = CandidateFit(probed, judge(replace(point, observation=asked)), evidence=20.0)
    assert polish(judge(point), found) is found, "its simulations fail"
    assert {"joints1+2.dead_zone.width", "load.mass", "joint2.motor.resistance"} <= set(asked.names)
    assert not any(name.startswith(("joint1.", "joint3.")) for name in asked.names)


def test_lifting_a_prior_brings_no_more_than_the_prior_costs() -> None:
    """Where a fit without it has not found its minimum, that is no evidence for a little more friction."""
    arm = imagined.arm()
    stated = arm.parameter("joint2.viscous_friction.coefficient")
    sound = point_at(*observe(arm, [imagined.trace(arm, seconds=4.0)]))
    k = [u.name for u in sound.unknowns].index("joint2.motor.resistance")
    astray = sound.values.copy()
    astray[k] *= 1.2
    before = judge(sound.moved_to(astray))
    (found,) = probe(before.point, hypotheses(arm, ("viscous_friction",), (2,)))
    j = [u.name for u in sound.unknowns].index(stated.name)
    values = sound.values.copy()
    values[j] += 0.2 * (stated.deviation or 0.0)
    started = point_at(sound.observation, sound.at(values), sound.tangents)
    lifted = replace(
        started, unknowns=tuple(replace(u, deviation=None) if u.name == stated.name else u for u in started.unknowns)
    )
    assert lifted.cost < before.point.cost - 50, "the other fit is astray"
    counted = with_evidence(before, found, lifted)
    assert counted.evidence + counted.price == pytest.approx(0.04)


# ---- One effect on several joints: found on all of them at once, and not where only one has it.

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
