"""Re-evaluates distortions with another convention of τ′. The changes that double the error do not depend on it."""

from __future__ import annotations

import math

from model.machine_model.model import Model
from model.validation.criterion import Fidelity, contribution
from model.validation.expected_deviation import Convention, expected_deviation


def in_convention(found: Fidelity, model: Model, convention: Convention) -> Fidelity:
    """Returns `found` with τ′, λ² and Σλ² of another convention, without simulating again."""
    parameters = []
    for one in found.parameters:
        expected, basis = expected_deviation(model.parameter(one.name), convention)
        judged = {"expected": expected, "basis": basis, "contribution": contribution(one.required, expected)}
        parameters.append(one.model_copy(update=judged))
    total = math.fsum(p.contribution for p in parameters)
    return found.model_copy(
        update={"parameters": tuple(parameters), "convention": convention, "sum_of_contributions": total}
    )
