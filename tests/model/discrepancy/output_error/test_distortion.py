"""Σλ² from derivatives is that from simulations, and says whether tolerances explain what is left."""

import numpy as np
import pytest

from model.discrepancy.output_error.distortion import sum_of_contributions
from model.fitting.records import records_of
from model.machine_model.model import Model
from model.simulation.prepared import Options
from model.simulation.simulate import sensitivities
from model.validation.fidelity import validate_by_distortion
from tests.model.discrepancy.motions import trace_of
from tests.model.fitting import imagined

NAMES = ("joint1.motor.back_emf_constant", "joint2.motor.back_emf_constant", "link2.mass")


def by_derivatives(model: Model, arm: Model) -> float:
    """Of `model` on a record of `arm`."""
    record = records_of([trace_of(arm, 8.0)], model.machine, "position")[0]
    run = sensitivities(model, record.inputs, [model.parameter(name) for name in NAMES], Options())
    residual = run.simulation.at_samples(run.simulation.reading) - record.measured
    return sum_of_contributions(model, NAMES, residual.ravel(), run.reading.reshape(len(NAMES), -1))


def test_sum_of_lambda_squared_agrees_with_the_search_by_simulations() -> None:
    arm = imagined.arm()
    searched = validate_by_distortion(arm, [trace_of(arm, 8.0)], NAMES, options=Options(quantise=False))
    assert by_derivatives(arm, arm) == pytest.approx(searched.sum_of_contributions, rel=0.1)


def test_sum_of_lambda_squared_is_small_where_tolerances_cannot_explain_the_residual() -> None:
    arm = imagined.arm()
    assert by_derivatives(arm, arm) > 1.0
    slow = arm.with_effect("supply_limit", (2,), {"voltage": 4.0})
    assert by_derivatives(arm, slow) < 0.2


def test_names_that_are_no_parameters_do_not_count() -> None:
    arm, slopes = imagined.arm(), np.ones((2, 5))
    both = sum_of_contributions(arm, ("link2.mass", "initial.trace1.joint1.position"), np.ones(5), slopes)
    assert both == sum_of_contributions(arm, ("link2.mass",), np.ones(5), slopes[:1])
