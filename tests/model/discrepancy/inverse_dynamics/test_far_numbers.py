"""A number of the machine that is far from its file: what stands for it, and on how little evidence it is named."""

from dataclasses import replace

import pytest

from daq.contracts.machine import Machine
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.far_numbers import far_numbers, stands_for_far_number
from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.discrepancy.inverse_dynamics.search import Fitted
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.inverse_dynamics.searches import sliding
from tests.model.discrepancy.inverse_dynamics.test_stated_numbers import answer, geared

MASS = "link1.mass"


def fits() -> tuple[BalanceFit, BalanceFit]:
    """The slide's fit with its mass five stated deviations off, and one deviation off."""
    now = sliding({}, TorqueOptions()).first
    mass = next(u for u in now.unknowns if u.name == MASS)
    assert mass.deviation is not None
    far, near = (replace(now, values={**now.values, MASS: mass.expected + off * mass.deviation}) for off in (5.0, 1.0))
    return far, near


def candidate(after: BalanceFit, evidence: float, cost: float = 13.0, relief: float = 1.0) -> Fitted:
    return Fitted("payload", (), after.balance.model, (), after, evidence, cost, relief=relief)


def test_a_number_of_the_machine_is_far_and_friction_of_the_file_is_not() -> None:
    far, near = fits()
    assert far_numbers(far) == {MASS}
    assert not far_numbers(near)
    of_effect = tuple(
        replace(u, parameter=replace(u.parameter, effect="coulomb_friction")) if u.name == MASS else u
        for u in far.unknowns
    )
    assert not far_numbers(replace(far, unknowns=of_effect))
    unstated = tuple(
        replace(u, parameter=replace(u.parameter, deviation=None)) if u.name == MASS else u for u in far.unknowns
    )
    assert not far_numbers(replace(far, unknowns=unstated)), "an assumed deviation is none of the file"


def test_only_what_brings_such_a_number_back_is_named_for_it() -> None:
    far, near = fits()
    assert stands_for_far_number(far, candidate(near, 4.0))
    assert stands_for_far_number(far, candidate(near, -10.0, cost=30.0)), "the cost of parameters is not counted"
    assert not stands_for_far_number(far, candidate(near, 2.0)), "a fall of 15"
    assert not stands_for_far_number(far, candidate(far, 4.0))
    assert not stands_for_far_number(near, candidate(near, 4.0))
    assert not stands_for_far_number(far, candidate(near, 4.0, relief=0.8))


def of_bench(constant: float) -> Diagnosis:
    """The motor bench with a magnet of this torque constant, N·m/A: 0.05 stated to 10 %, its back-EMF to 2 %."""
    stated = rigs.bench_machine().model_dump()
    drive = stated["joints"][0]["drive"]
    drive["resistance"].update(deviation=0.2, low=0.1)
    drive["torque_constant"].update(deviation=0.005, low=0.001)
    traces = [
        rigs.bench_trace(seed, {"resistance": 2.3, "constant": constant, "back_emf": constant}) for seed in (1, 2)
    ]
    return diagnose_torques(base_model(Machine.model_validate(stated)), traces[:1], traces[1:])


@pytest.mark.parametrize(("constant", "weaker"), [pytest.param(0.045, 0.1, marks=pytest.mark.slow), (0.0465, None)])
def test_a_magnet_is_weakened_from_four_deviations_of_its_better_known_constant(
    constant: float, weaker: float | None
) -> None:
    """10 % and 7 % weaker are 4.7 and 3.4 deviations of the back-EMF constant."""
    found = of_bench(constant)
    named = [s for s in found.steps if s.adopted]
    assert [s.effect for s in named] == ([] if weaker is None else ["weakened_magnet"]), found.summary
    for step in named:
        (loss,) = step.parameters.values()
        assert loss.value == pytest.approx(weaker, abs=0.01)


@pytest.mark.slow
def test_a_far_number_is_named_beside_a_small_effect_on_little_evidence() -> None:
    """Its 4.6 deviations bring evidence of 7: every other effect needs 30, and 10 to stay when all are looked for
    again."""
    friction, rotor = (s for s in answer(geared(0.0307, 0.002), coulomb=0.003).steps if s.adopted)
    assert (friction.effect, rotor.effect) == ("coulomb_friction", "wrong_rotor_inertia")
    assert rotor.evidence < 10.0
