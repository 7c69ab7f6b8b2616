"""The gap of a diagnosis in torques goes from the given model over its fitted numbers to each effect that was taken."""

from __future__ import annotations

import math

from model.discrepancy.diagnosis import SignalError, Step
from model.discrepancy.inverse_dynamics.gap import torque_gap
from tests.model.discrepancy.steps import step


def errors(before: float, after: float) -> tuple[SignalError, ...]:
    return (SignalError(joint=1, unit="N·m", before=before, after=after, floor=0.1),)


def taken(effect: str, before: float, after: float, *, adopted: bool = True) -> Step:
    return step(effect, rmse_fit=errors(before, after), rmse_holdout=errors(10 * before, 10 * after), adopted=adopted)


def test_it_goes_from_the_given_model_to_each_effect_that_was_taken() -> None:
    steps = [
        taken("gear_loss", 3.0, 2.5, adopted=False),
        taken("coulomb_friction", 3.0, 2.0),
        taken("backlash", 2.0, 1.0),
    ]
    found = torque_gap(errors(4.0, 0.9), errors(40.0, 9.0), steps)
    assert [(s.kind, s.effect, s.fitted[0], s.held_out[0]) for s in found.stages] == [
        ("given", None, 4.0, 40.0),
        ("fitted", None, 3.0, 30.0),
        ("effect", "coulomb_friction", 2.0, 20.0),
        ("effect", "backlash", 0.9, 9.0),  # of the last fit, not of the step
    ]
    assert (found.joints, found.units, found.noise) == ((1,), ("N·m",), (0.1,))


def test_without_an_effect_or_held_out_records_it_has_two_stages() -> None:
    found = torque_gap(errors(4.0, 0.9), (), [])
    assert [(s.kind, s.fitted, s.held_out) for s in found.stages] == [("given", (4.0,), ()), ("fitted", (0.9,), ())]


def test_what_is_not_finite_has_no_number() -> None:
    assert torque_gap(errors(math.nan, math.inf), (), []).stages[0].fitted == (None,)
