"""An arm that others wrote, diagnosed with its recorded drive as the input."""

from dataclasses import replace

import numpy as np
import pytest

from model.discrepancy.controller.evidence import check_controller, settled_by_records, with_used_set_points
from model.discrepancy.controller.sampled import with_errors
from model.discrepancy.engine.fitting import evaluate
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.workflow import diagnose
from model.fitting.records import records_of
from model.machine_model.model import base_model
from model.machine_model.parameter import Kind
from tests.model.discrepancy import outside_arm
from tests.model.discrepancy.readings.cases import case_of, fitted

MACHINE = outside_arm.machine()
BY_SIMULATION = DiagnosisOptions(method="output-error")


@pytest.fixture(scope="module")
def sound() -> outside_arm.OutsideArm:
    return outside_arm.drawn(1)


@pytest.mark.slow
def test_a_sound_arm_is_explained_to_the_noise_of_its_readings(sound: outside_arm.OutsideArm) -> None:
    """Its drive is rounded to 0.14 V and limited, which the record of the drive tells and no law needs to."""
    case = case_of(base_model(MACHINE), [outside_arm.record(sound, 11)])
    assert case.compared.observation.drive_is_input
    left = fitted(case)
    assert np.mean(left.weighted(left.row) ** 2) == pytest.approx(1.0, abs=0.08)


@pytest.mark.slow
def test_sudden_friction_with_the_true_numbers_leaves_the_noise_of_readings() -> None:
    """The arm's friction is there at once: its model's must not need a distance to build up."""
    arm = outside_arm.drawn(106)
    case = case_of(base_model(MACHINE), [outside_arm.record(arm, 1061)])
    unknowns = case.unknowns(case.given, {})
    true = {"controller.delay": arm.delay}
    for joint in range(3):
        true[f"link{joint + 1}.mass"] = arm.mass[joint]
        own = f"joint{joint + 1}."
        true[own + "motor.resistance"] = arm.resistance[joint]
        true[own + "viscous_friction.coefficient"] = arm.viscous[joint]
        true[own + "coulomb_friction.torque"] = arm.coulomb[joint]

    def misfit(**forms: float) -> float:
        values = {u.name: true.get(u.name, forms.get(u.kind.name, u.expected)) for u in unknowns}
        left = evaluate(case.compared, unknowns, values, np.ones(3))
        return float(np.mean(left.weighted(left.row) ** 2))

    shortest = min(u.low for u in unknowns if u.kind is Kind.PRESLIDING)
    assert misfit(PRESLIDING=shortest, PRESLIDING_SHAPE=0.0) == pytest.approx(1.0, abs=0.06)
    assert misfit() > 3.0, "with the expected distance, half a count"


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("seed", [106, 107])
def test_a_sound_arm_is_not_called_unsound(seed: int) -> None:
    arm = outside_arm.drawn(seed)
    traces = [outside_arm.record(arm, 10 * seed + k) for k in (1, 2)]
    found = diagnose(base_model(MACHINE), traces[:1], traces[1:], BY_SIMULATION)
    assert found.verdict == "nothing-significant", found.summary


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_dead_zone_is_found() -> None:
    arm = outside_arm.drawn(11).changed("dead_zone", 2, 1.2)
    records = [outside_arm.record(arm, seed) for seed in (111, 112)]
    answer = diagnose(base_model(MACHINE), records[:1], records[1:], BY_SIMULATION)
    step = answer.steps[0]
    assert (step.effect, step.joints) == ("dead_zone", (2,))
    assert next(iter(step.parameters.values())).value == pytest.approx(1.2, abs=0.05)


@pytest.mark.parametrize("limit", [pytest.param(16.0, marks=pytest.mark.slow), 9.0])
def test_lost_set_points_are_proved_by_the_drive(sound: outside_arm.OutsideArm, limit: float) -> None:
    arm = replace(sound.changed("lost", 2, 0.05), limit=limit)
    machine = outside_arm.machine(limit=limit)
    made = outside_arm.record(arm, 11)
    (found,) = check_controller(with_errors([made], machine), machine)
    assert (found.effect, found.joint) == ("lost_set_points", 2)
    assert found.value == pytest.approx(0.05, abs=0.02)
    restored = with_used_set_points(with_errors([made], machine)[0])
    assert not np.array_equal(restored.set_point[:, 1], made.set_point[:, 1])
    assert np.allclose(restored.set_point[:, [0, 2]], made.set_point[:, [0, 2]])


@pytest.mark.parametrize("factor", [0.9, 1.05, 1.4])
def test_a_wrong_gain_is_measured_by_the_drive(sound: outside_arm.OutsideArm, factor: float) -> None:
    made = with_errors([outside_arm.record(sound.changed("factor", 3, factor), 11)], MACHINE)
    (found,) = check_controller(made, MACHINE)
    assert (found.effect, found.joint) == ("wrong_gain", 3)
    assert found.value == pytest.approx(factor - 1, abs=0.005), "a rounding that repeats itself while the joint rests"


def test_the_drive_of_another_controller_proves_nothing(sound: outside_arm.OutsideArm) -> None:
    made = outside_arm.record(sound, 11)
    late = replace(made, drive=np.roll(made.drive, 1, axis=0))
    assert with_errors([late], MACHINE)[0] is late
    assert check_controller([late], MACHINE) == ()
    assert settled_by_records([late], MACHINE) == ()


def test_set_points_are_compared_with_the_travel_not_with_counts(sound: outside_arm.OutsideArm) -> None:
    """An encoder of 24 bits makes half a million counts of a lag of 0.2 rad."""
    fine = MACHINE.joints[0].sensor
    joints = tuple(j.model_copy(update={"sensor": fine.model_copy(update={"bits": 24})}) for j in MACHINE.joints)
    made = outside_arm.record(sound, 11)
    assert records_of([made], MACHINE.model_copy(update={"joints": joints}), "position")
