"""What a prediction imagines: an arm that begins at rest, as the real one does."""

import numpy as np
import pytest

from model.discrepancy.engine.fitting import evaluate
from model.discrepancy.experiment_design.separation import Prediction, imagine
from model.discrepancy.readings.observation import observe
from tests.model.discrepancy.experiment_design.test_next_experiment import EXPERIMENTS, plan, record
from tests.model.discrepancy.readings.cases import case_of
from tests.model.fitting import imagined

COUNT = 0.0015
"""rad of a reading, nearly."""


@pytest.mark.parametrize(
    ("effect", "joint", "size"),
    [("potentiometer_offset", 3, {"offset": 0.12}), ("potentiometer_gain", 2, {"relative": -0.1})],
)
def test_an_imagined_arm_begins_at_rest_where_its_potentiometer_reads_the_set_point(
    effect: str, joint: int, size: dict[str, float]
) -> None:
    model = imagined.arm().with_effect(effect, (joint,), size)
    spec = EXPERIMENTS["ramp"].spec
    case = case_of(model, [record(model, spec, 3)])
    unknowns = case.unknowns(case.given, {})
    point = evaluate(case.compared, unknowns, {u.name: u.start for u in unknowns}, np.ones(3))
    there = imagine(model, spec, plan)
    assert there is not None
    predicted = Prediction(there, point).recorded()
    (own,) = predicted.there.observation.records
    resting = slice(0, 20)
    away = np.abs(own.measured[resting] - own.inputs.set_points[resting])
    assert away.max() < 6 * COUNT
    assert abs(predicted.begun[f"initial.trace1.joint{joint}.position"]) > 0.02


def test_starts_have_the_same_freedom_when_a_model_with_bent_potentiometers_is_observed_again() -> None:
    trace = record(imagined.arm(), EXPERIMENTS["ramp"].spec, 3)
    _, model, first = observe(imagined.arm(), [trace])
    _, _, again = observe(model, [trace])
    starts = [[(u.low, u.deviation) for u in given if u.trace is not None] for given in (first, again)]
    assert starts[0] == starts[1]
