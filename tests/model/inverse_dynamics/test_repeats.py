"""The noise that repeated motion shows."""

import numpy as np

from daq.contracts.trace import Trace
from model.arrays import Floats
from model.inverse_dynamics.recorded_motion import RecordedMotion, recorded_motion
from model.inverse_dynamics.repeats import repeated_noise
from tests.model.discrepancy.inverse_dynamics import rigs

TIME = np.arange(0.0, 20.0, 0.002)


ONE_WAY = np.array([False])


def motion(position: Floats) -> RecordedMotion:
    trace: Trace = rigs.trace_of("made", TIME, position[:, None], np.ones((len(TIME), 1)), "N")
    return recorded_motion(trace, rigs.slide_machine(), 8.0)


def residual(record: RecordedMotion, noise: float) -> Floats:
    """A large torque that follows from the motion, and noise."""
    moved = 5.0 * np.sin(20 * record.position[record.rows]) + 10.0 * record.speed[record.rows]
    return moved + noise * np.random.default_rng(1).standard_normal(moved.shape)


def test_what_differs_between_passages_of_a_motion_is_noise() -> None:
    record = motion(0.1 * np.sin(2 * np.pi * 0.5 * TIME))
    for noise in (0.2, 1.0):
        found = repeated_noise([record], [residual(record, noise)], ONE_WAY)
        assert abs(found[0] - noise) < 0.2 * noise


def test_a_motion_that_does_not_recur_shows_none() -> None:
    record = motion(0.1 * np.sin(2 * np.pi * 0.02 * TIME**2) + 0.01 * TIME)
    assert repeated_noise([record], [residual(record, 1.0)], ONE_WAY)[0] == 0.0


def test_a_joint_that_turns_round_is_where_it_was_after_a_turn() -> None:
    """A torque that repeats every turn is no noise, however far the joint has turned."""
    record = motion(np.pi * TIME + 0.5 * np.sin(np.pi * TIME))
    torque = 2.0 * np.sin(7 * record.position[record.rows])
    noisy = torque + 0.2 * np.random.default_rng(1).standard_normal(torque.shape)
    assert 0.18 < repeated_noise([record], [noisy], np.array([True]))[0] < 0.24
    assert repeated_noise([record], [noisy], ONE_WAY)[0] == 0.0
