"""Joints that friction holds, and joints that shake faster than torques are compared."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.inverse_dynamics import friction_at_rest
from model.inverse_dynamics import supplied_torque as kernel
from model.inverse_dynamics.friction_at_rest import (
    RestingFriction,
    follow_limits,
    held_friction,
    subtract_friction,
    subtract_held,
)
from model.inverse_dynamics.link_motion import LinkMotion
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import RecordedMotion, low_pass
from model.inverse_dynamics.shaking import Shaking, find_shaking
from model.machine_model.model import base_model
from model.simulation.own_table import own_table
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.inverse_dynamics.rigs import slide_machine, slide_trace
from tests.model.inverse_dynamics.driven_slide import TIME, motion_of


def slow_at_reversals() -> RecordedMotion:
    """The slide, of which a fifth is too slow to tell which way it moves."""
    record = motion_of(np.sin(2.7 * TIME))
    turning = np.array([0.02])
    return replace(record, turning=turning, contact=np.clip(record.speed / turning, -1.0, 1.0))


RECORD = slow_at_reversals()
TURNS = RECORD.turns[:, 0]
SHAPE = RECORD.speed.shape


def held(left: Floats, level: float) -> Floats:
    """What friction of this level leaves of a residual torque (k, 1)."""
    return subtract_held(left, coulomb(level), RECORD)


def coulomb(level: float) -> RestingFriction:
    """Coulomb friction of a level."""
    whole = np.full(SHAPE, level)
    return RestingFriction(-level * RECORD.contact, -whole, whole)


def below_cutoff(torque: Floats) -> float:
    """Root mean square of a torque (k, 1) below the cutoff, within passages."""
    return float(np.sqrt(np.mean(low_pass(torque, RECORD.cutoff, RECORD.period)[TURNS] ** 2)))


def noise(seed: int) -> Floats:
    return np.random.default_rng(seed).standard_normal(SHAPE)


def test_the_record_has_passages_and_what_noise_leaves_at_them_is_taken_up(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 0.1 < TURNS.mean() < 0.5

    def left_on_average() -> float:
        return float(np.mean([below_cutoff(held(noise(seed), 2.0)) for seed in range(8)]))

    taken = left_on_average()
    monkeypatch.setattr(friction_at_rest, "HOLDING_ROUNDS", 0)
    assert taken < 0.8 * left_on_average()


@given(seed=st.integers(0, 10_000), level=st.floats(0.0, 5.0), size=st.floats(0.01, 10.0))
def test_friction_takes_its_level_beside_the_mean_and_no_more_and_acts_at_passages_alone(
    seed: int, level: float, size: float
) -> None:
    left = size * noise(seed) + size * np.sin(3.0 * RECORD.time)[:, None]
    found = held(left, level)
    assert np.array_equal(found[~TURNS], left[~TURNS])
    asked = RECORD.mean_in_turn(left - level * RECORD.contact)
    assert np.abs(found - asked)[TURNS].max() <= level + 1e-9


def test_friction_takes_no_more_than_it_could_have_held() -> None:
    # A torque within the level at passages, and none elsewhere
    left = np.where(RECORD.turns, 1.5 + 2.0 * RECORD.contact, 0.0)
    assert below_cutoff(held(left, 2.0)) < 1e-9
    assert below_cutoff(left) > 1.0
    level, torque = 2.0, 9.0
    found = held(np.full(SHAPE, torque) + level * RECORD.contact, level)
    assert found[TURNS] == pytest.approx(torque - level)
    left = np.sin(3.0 * RECORD.time)[:, None] + 0.1 * noise(4)
    np.testing.assert_allclose(held(left, 0.0), np.where(RECORD.turns, RECORD.mean_in_turn(left), left))
    fast = replace(RECORD, speed=np.full(SHAPE, 1.0))
    left = noise(5)
    assert subtract_held(left, coulomb(2.0), fast) is left


def test_friction_that_is_more_one_way_holds_more_on_that_side() -> None:
    """A torque within the level of one direction at passages, and beyond it in the other."""
    joints = np.zeros((1, at.PER_JOINT))
    joints[0, at.DIRECTION] = 1.5
    motion = LinkMotion(RECORD.position, RECORD.speed, RECORD.acceleration, RECORD.contact)
    friction = friction_at_rest.friction_at_rest(np.full(SHAPE, 2.0), motion, joints)
    forwards = np.where(RECORD.turns, -3.5 - friction.sliding, 0.0)  # forwards, friction acts backwards
    assert np.abs(subtract_held(forwards, friction, RECORD)[TURNS]).max() == pytest.approx(0.0, abs=1e-9)
    backwards = np.where(RECORD.turns, 3.5 - friction.sliding, 0.0)
    assert subtract_held(backwards, friction, RECORD)[TURNS].max() > 1.0


@pytest.mark.parametrize("column", [at.STRIBECK, at.BREAKAWAY])
def test_friction_that_fades_or_has_to_be_broken_holds_more_both_ways(column: int) -> None:
    joints = np.zeros((1, at.PER_JOINT))
    joints[0, column], joints[0, at.STRIBECK_SPEED] = 1.5, 0.1
    motion = LinkMotion(RECORD.position, RECORD.speed, RECORD.acceleration, RECORD.contact)
    friction = friction_at_rest.friction_at_rest(np.full(SHAPE, 2.0), motion, joints)
    np.testing.assert_allclose((friction.lowest, friction.highest), (np.full(SHAPE, -3.5), np.full(SHAPE, 3.5)))


@pytest.mark.parametrize("difference", [1.5, -0.7])
def test_sliding_friction_is_what_the_balance_counts(difference: float) -> None:
    """The laws stand in the compiled torques as well; what is held is held in place of exactly that."""
    model = base_model(rigs.slide_machine())
    for name, sizes in (
        ("coulomb_friction", {"torque": 2.0}),
        ("direction_dependent_friction", {"difference": difference}),
        ("stribeck_friction", {"torque": 0.8, "speed": 0.03}),
    ):
        model = model.with_effect(name, (1,), sizes)
    joints = np.ascontiguousarray(model.vector[at.SHARED :].reshape(1, at.PER_JOINT))
    level, none = np.full(SHAPE, 2.0), np.zeros(SHAPE)
    motion = LinkMotion(RECORD.position, RECORD.speed, RECORD.acceleration, RECORD.contact)
    driven = kernel.DrivenMotion(
        RECORD.time, RECORD.position, RECORD.speed, RECORD.contact, RECORD.speed, none, level, none
    )
    motor, other, rise = (np.empty(SHAPE) for _ in range(3))
    numbers = kernel.JointNumbers(joints, model.flags, own_table(model, np.float64))
    kernel.supplied_torque(driven, numbers, motor, other, rise)
    assert np.abs(other).max() > 2.5
    np.testing.assert_allclose(friction_at_rest.friction_at_rest(level, motion, joints).sliding, other, atol=1e-12)


# ---- Joints that shake faster than torques are compared are told, and what is slow or noise is not


def shaken(trace: Trace, hertz: float, size: float) -> Trace:
    """The trace of a slide that shakes by `size` (m)."""
    return replace(trace, position=trace.position + size * np.sin(2 * np.pi * hertz * trace.time)[:, None])


def shaking(*traces: Trace) -> tuple[Shaking, ...]:
    machine = slide_machine()
    return find_shaking(traces, machine, choose_cutoff(traces[:1], machine))


@pytest.mark.parametrize("hertz", [25.0, 40.0, 80.0])
def test_the_frequency_of_a_limit_cycle_is_told(hertz: float) -> None:
    sound = slide_trace(1, {})
    (found,) = shaking(shaken(sound, hertz, 100.0 / (2 * np.pi * hertz) ** 2))
    assert found.joint == 1
    assert found.frequency == pytest.approx(hertz, abs=1.0)
    assert found.factor > 10.0


def test_the_trace_that_shakes_most_is_told_and_nothing_slow_noisy_or_commanded() -> None:
    sound = slide_trace(1, {})
    weak, strong = shaken(sound, 25.0, 0.002), shaken(sound, 40.0, 0.004)
    (found,) = shaking(sound, weak, strong)
    assert found.frequency == pytest.approx(40.0, abs=1.0)
    sound = slide_trace(1, {})
    noise = np.random.default_rng(5).normal(0.0, 1e-4, sound.position.shape)
    assert shaking(sound) == ()
    assert shaking(shaken(sound, 2.0, 0.01)) == ()
    assert find_shaking([replace(sound, position=sound.position + noise)], slide_machine(), 12.0) == ()
    # What can be compared counts, and not what the user asked to compare
    fitted, held = (shaken(slide_trace(seed, {}, 8.0), 7.0, 0.02) for seed in (1, 2))
    found = diagnose_torques(base_model(slide_machine()), [fitted], [held], TorqueOptions(cutoff=2.0))
    assert not [note for note in found.notes_data if note.kind == "shakes-above-cutoff"]
    fitted, held = (shaken(slide_trace(seed, {}, 8.0), 40.0, 1e-3) for seed in (1, 2))
    found = diagnose_torques(base_model(slide_machine()), [fitted], [held])
    assert [note.kind for note in found.notes_data if note.warning] == ["shakes-above-cutoff"]
    assert "joint 1 at 40 Hz" in " ".join(found.notes)


@pytest.mark.parametrize("rate", [25.0, 40.0, 40.03])
def test_a_record_without_frequencies_above_the_cutoff_says_nothing(rate: float) -> None:
    sound = slide_trace(1, {})
    time = np.arange(0.0, 16.0, 1.0 / rate)
    assert sound.drive is not None
    position, drive = (np.interp(time, sound.time, s[:, 0])[:, None] for s in (sound.position, sound.drive))
    assert find_shaking([replace(sound, time=time, position=position, drive=drive)], slide_machine(), 12.0) == ()


@given(seed=st.integers(0, 10_000), size=st.floats(0.01, 3.0))
def test_derivatives_with_friction_as_it_is_foretell_no_fall_that_friction_would_undo(seed: int, size: float) -> None:
    """Friction may follow a torque within its limits, and leaves no more than if it stayed as it was."""
    left, change = noise(seed) + np.sin(2.0 * RECORD.time)[:, None], size * np.sin(5.0 * RECORD.time)[:, None]
    friction = coulomb(1.0)
    taken = held_friction(left, friction, RECORD)
    stays = subtract_friction(left + change, friction, RECORD, follow_limits(taken, friction, friction))
    follows = subtract_held(left + change, friction, RECORD)
    assert below_cutoff(follows) <= 1.05 * below_cutoff(stays) + 1e-9
    more = follow_limits(taken, friction, coulomb(1.5))
    at_limit = np.abs(taken) >= 1.0
    np.testing.assert_allclose(np.abs(more[at_limit]), 1.5)
    np.testing.assert_array_equal(more[~at_limit], taken[~at_limit])
