"""What follows from the published tables alone."""

import pytest

from daq.contracts.machine import load_machine
from extras.thesis.figures import influence_tables
from extras.thesis.tables import (
    BASIC,
    LADDER,
    SYMBOLS,
    VISCOUS_AND_COULOMB,
    basis_of_symbol,
    model_of,
    recomputed_fidelities,
    unfitted,
)
from model import layout as at
from model.simulation.bodies import rod_arm_body


@pytest.mark.parametrize("index", range(4))
def test_published_sums_follow_from_the_tables_within_three_percent(index: int) -> None:
    found = recomputed_fidelities("source")[index]
    assert found.published == (0.2449, 0.4431, 0.5973, 0.9313)[index]
    assert found.ours == pytest.approx((0.2426, 0.4452, 0.5834, 0.9295)[index], abs=5e-4)
    assert abs(found.relative_difference) < 0.03


def test_three_sigma_taken_literally_gives_over_forty_percent_more() -> None:
    assert all(0.42 <= f.relative_difference <= 0.46 for f in recomputed_fidelities("three_sigma"))


def test_each_table_has_the_parameters_of_its_model() -> None:
    assert [len(m.free) for m in LADDER] == [8, 9, 12, 13]
    assert all(set(m.deviations) == set(m.values) for m in LADDER)
    assert [s.name for s in SYMBOLS if basis_of_symbol(s.name) == "mass"] == ["m1", "m2", "m3", "MLOAD"]
    assert [s.name for s in SYMBOLS if basis_of_symbol(s.name) == "length"] == ["R1", "A2", "A3"]


def test_a_table_becomes_a_model_with_its_values() -> None:
    machine = load_machine("ma2000")
    model = model_of(VISCOUS_AND_COULOMB, machine)
    for symbol in SYMBOLS:
        assert model.parameter(symbol.parameter).value == VISCOUS_AND_COULOMB.values[symbol.name]
    assert model.published_inertia
    basic = model_of(BASIC, machine)
    assert not basic.effects
    assert basic.parameter("joint2.motor.back_emf_constant").value == 0.0334


def test_the_model_and_the_arm_of_chapter_8_have_the_same_bodies() -> None:
    model = model_of(VISCOUS_AND_COULOMB, load_machine("ma2000"))
    joints = model.vector[at.SHARED :].reshape(3, at.PER_JOINT).copy()
    body = rod_arm_body(model.vector[: at.SHARED].copy(), joints, model.flags.copy())
    arm = VISCOUS_AND_COULOMB.arm().vector()
    assert arm[: len(body)] == pytest.approx(body, rel=1e-9)


def test_fits_start_where_the_source_starts() -> None:
    start = unfitted(VISCOUS_AND_COULOMB, load_machine("ma2000"))
    assert start.parameter("link2.length").value == 0.23
    assert start.parameter("joint2.viscous_friction.coefficient").value == 0.0
    assert start.parameter("joints1+2+3.load_dependent_friction.arm").value == 0.0


def test_tables_of_chapter_5_hold_but_for_the_waist() -> None:
    entries = {(e.table, e.joint): e for e in influence_tables()}
    wrong = {key for key, e in entries.items() if e.published_too_many or e.published_too_few}
    assert wrong == {("5.1", 1), ("5.2", 1)}
    assert entries["5.1", 1].published_too_many == ("m2", "c2x", "c2y", "c2z", "I2zz", "I3zz")
    assert entries["5.1", 1].published_too_few == ()
