"""Candidates that are far from where the search for the tolerance parameters has led."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from model.discrepancy.candidates.library import hypotheses
from model.discrepancy.candidates.probing import probe
from model.discrepancy.output_error.candidate_fit import diverged_from_prior, judge, refit, restart, with_evidence
from model.discrepancy.output_error.observation import Observation, observe
from model.discrepancy.output_error.search import converge, point_at
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
    (found,) = probe(before.point, hypotheses(before.point.model, ("back_emf_error",), (2,)))
    counted = counting(monkeypatch)
    assert refit(before, found) is not None
    with_time, counted[:] = len(counted), []
    refit(before, found, goal=1.0)
    assert 0 < len(counted) < 0.7 * with_time


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
