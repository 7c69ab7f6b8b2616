"""The remaining torque: what was put in comes out, at its joint, against what it depends on, and never from noise."""

import numpy as np
import pytest

from model.discrepancy.diagnosis import CLEAR_SHAPE, AgainstWhat, RemainingShape, clear_shape
from model.discrepancy.localisation.phases import AskedMotion
from model.discrepancy.localisation.residuals import Residuals
from model.discrepancy.localisation.unexplained_torque import remaining_shapes, torque_of
from model.fitting.records import Record, noise_floor, records_of
from model.machine_model.model import Model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.discrepancy.motions import trace_of
from tests.model.fitting import imagined

JOINT = 3
STIFFNESS = 1.5


@pytest.fixture(scope="module")
def arm() -> Model:
    return imagined.arm()


def left(arm: Model, record: Record, following: float = 0.0) -> np.ndarray:
    run = simulate(arm, record.inputs, Options(quantise=False, following=following))
    return np.asarray(record.measured - run.at_samples(run.reading))


@pytest.mark.parametrize("following", [0.0, 0.5])
def test_a_spring_that_the_model_lacks_comes_out_as_a_torque_against_position(arm: Model, following: float) -> None:
    sprung = arm.with_effect("spring_torque", (JOINT,), {"stiffness": STIFFNESS, "rest": -0.4})
    records = records_of([trace_of(sprung)], arm.machine, "position")
    deviations = noise_floor(records, arm.machine, "position")
    residuals = Residuals(arm, records, [left(arm, records[0], following)], deviations, feedback_share=following)
    found = remaining_shapes(residuals)
    first = found[0]
    assert (first.joint, first.against, first.torque_unit) == (JOINT, "position", "N·m")
    assert first.explained > 0.5
    pairs = [(x, t) for x, t in zip(first.centres, first.torque, strict=True) if t is not None]
    slope = np.polyfit(*np.array(pairs).T, 1)[0]
    assert slope == pytest.approx(-STIFFNESS, rel=0.25)
    torque = torque_of(residuals)[0][records[0].runs[0], JOINT - 1]
    true = -STIFFNESS * (AskedMotion(arm.machine, records[0]).position[records[0].runs[0], JOINT - 1] + 0.4)
    assert np.corrcoef(torque, true)[0, 1] > 0.85


def test_no_torque_remains_of_an_arm_that_is_the_model(arm: Model) -> None:
    records = records_of([trace_of(arm)], arm.machine, "position")
    deviations = 1.3 * noise_floor(records, arm.machine, "position")
    assert remaining_shapes(Residuals(arm, records, [left(arm, records[0])], deviations)) == ()


@pytest.mark.parametrize(
    ("against", "torque", "explained", "clear"),
    [
        ("time", (0.1, 0.2), 0.64, False),
        ("position", (0.1, None, 0.2, 0.3, 0.4), 0.64, False),
        ("position", (0.1, None, 0.2, 0.3, 0.4, 0.5), 0.64, True),
        ("speed", (0.1, 0.2, 0.3, 0.4, 0.5), CLEAR_SHAPE - 0.01, False),
        ("speed", (0.1, 0.2, 0.3, 0.4, 0.5), CLEAR_SHAPE, True),
        ("direction", (-0.1, None, 0.1), 0.64, True),
    ],
)
def test_a_shape_is_clear_where_it_explains_enough_in_enough_bins(
    against: AgainstWhat, torque: tuple[float | None, ...], explained: float, clear: bool
) -> None:
    shape = RemainingShape(
        joint=1,
        against=against,
        unit="1",
        torque_unit="N·m",
        centres=(0.0,) * len(torque),
        torque=torque,
        deviation=torque,
        explained=explained,
    )
    assert (clear_shape([shape]) is not None) == clear


def test_the_clear_shape_is_the_one_that_explains_most_in_any_order() -> None:
    """Torques without a controller are listed by joint."""
    shape = RemainingShape(
        joint=1,
        against="speed",
        unit="rad/s",
        torque_unit="N·m",
        centres=(0.0,) * 5,
        torque=(0.1,) * 5,
        deviation=(0.1,) * 5,
        explained=0.4,
    )
    better = shape.model_copy(update={"joint": 2, "explained": 0.7})
    assert clear_shape([shape, better]) == better
    assert clear_shape([]) is None
